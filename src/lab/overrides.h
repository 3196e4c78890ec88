// SPDX-License-Identifier: Apache-2.0
// Command-line overrides of a suite: smaller presets need no new file.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "lab/suite.h"

namespace covary::lab {

/// What is left of a suite in a quick experiment.
struct QuickLimits {
  size_t seeds = 3;
  uint32_t spp = 192;
  uint32_t reference_spp = 1024;  ///< of each half
  double seconds = 0;             ///< of budgets in seconds; 0: no limit
  int64_t pixels = 32400;         ///< of frames that the suite neither sizes nor crops
  int64_t crop_pixels = 12000;
  int64_t sized_pixels = 0;               ///< of frames that the suite sizes; 0: no limit
  size_t scenes = 0;                      ///< the first of them; 0: all
  std::vector<std::string> methods = {};  ///< only these, and the baseline; empty: all
};

struct Overrides {
  std::vector<uint64_t> seeds;
  std::vector<Budget> budgets;
  std::string crop, resolution;      ///< of every scene
  std::string size;                  ///< WIDTHxHEIGHT: whole frames, in their own shape, of at most as many pixels
  std::vector<std::string> scenes;   ///< only these
  std::vector<std::string> methods;  ///< only these, and the baseline
  std::string baseline;
  std::optional<uint32_t> reference_spp;
  std::vector<std::string> reference_files;  ///< of every scene
  std::optional<QuickLimits> quick;
};

/// Maximum number of pixels of frames that the suite neither sizes nor crops; 0: no limit.
int64_t max_pixels(const Overrides& overrides);

/// Throws Error(kUsage) if a named scene or method is not in the suite, or for invalid sizes.
void apply(const Overrides& overrides, Suite& suite);

}  // namespace covary::lab
