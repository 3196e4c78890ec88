// SPDX-License-Identifier: Apache-2.0
// Command-line overrides of a suite: smaller presets need no new file.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "lab/suite.h"

namespace covary::lab {

struct Overrides {
  std::vector<uint64_t> seeds;
  std::vector<Budget> budgets;
  std::string crop, resolution;      ///< of every scene
  std::vector<std::string> scenes;   ///< only these
  std::vector<std::string> methods;  ///< only these, and the baseline
  std::string baseline;
  std::optional<uint32_t> reference_spp;
  std::vector<std::string> reference_files;  ///< of every scene
  /// At most 3 seeds, 192 samples per pixel, 1024 in each half of a reference, crops of kQuickCropPixels.
  bool quick = false;
};

/// In a quick experiment, maximum number of pixels of frames that the suite neither sizes nor crops, and of its crops.
inline constexpr int64_t kQuickPixels = 32400, kQuickCropPixels = 12000;

/// Throws Error(kUsage) if a named scene or method is not in the suite, or for invalid sizes.
void apply(const Overrides& overrides, Suite& suite);

}  // namespace covary::lab
