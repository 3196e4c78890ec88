// SPDX-License-Identifier: Apache-2.0
// The settings of `covary combine`. Python's combine() takes images instead of files, but otherwise the same settings.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "combine/registry.h"
#include "denoising/mixed_denoising.h"
#include "settings/settings.h"

namespace covary {

/// Help of `memory`.
inline constexpr const char* kMemoryHelp =
    "Memory limit in MiB: larger images are processed in bands of rows, with the same bits, or refused where whole "
    "images are needed (layers, frames with history); default: 6144 for bands, most of the machine's memory otherwise";

/// Position in the full frame.
struct PixelPosition {
  int x, y;
};

struct CombineSettings {
  std::vector<std::string> crn;          ///< files of one image, see GroupedFile; empty: `independent` is denoised
  std::vector<std::string> independent;  ///< likewise
  std::string output;
  std::string crn_layer, independent_layer;  ///< for files with several layers
  std::string counts;                        ///< file with the samples of each pixel of the independent image
  std::string light;                         ///< film of light paths
  std::string features;                      ///< file with the features of the denoising
  std::vector<std::string> layers;           ///< of the independent image's files, to be denoised as it is
  std::string estimator = kDefaultEstimator;
  std::optional<int> samples;  ///< samples per pixel of the CRN image
  DenoisingChoice denoising;
  std::string device = "cpu";  ///< where it runs, as gpu::Target::open() takes it
  bool error = false;          ///< also estimate the standard error
  bool force = false;          ///< combine despite errors in the inputs
  std::optional<PixelPosition> explain;
  std::optional<double> memory_mib;  ///< memory limit
};
void declare(Settings& settings, CombineSettings& v);

/// Declares `device`.
void declare_device(Settings& settings, std::string& device);

}  // namespace covary
