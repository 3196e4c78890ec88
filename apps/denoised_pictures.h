// SPDX-License-Identifier: Apache-2.0
// What `covary denoise` makes of each picture of its inputs.
#pragma once

#include <fmt/format.h>

#include <functional>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "combine/registry.h"
#include "combine/result_file.h"
#include "denoising/denoise.h"
#include "denoising/denoising_choice.h"
#include "denoising/history.h"
#include "film/pictures.h"
#include "frame_files.h"
#include "gpu/target.h"
#include "next_frame.h"
#include "picture_options.h"
#include "progress.h"
#include "risk/predicted_error.h"
#include "settings/settings.h"

namespace covary {

/// The command's options.
struct DenoiseCommand {
  std::vector<std::string> inputs;
  std::string output, mode, oidn, albedo, normal, json;
  PictureChoice choice;
  std::vector<std::string> layers;
  bool no_features = false, clean_features = false, check = false, force = false, overwrite = false;
  bool quiet = false, verbose = false;
  FrameOptions of_frames;
  std::optional<double> memory_mib;
  std::string device = gpu::kProcessor;
  OptionValues values;  ///< of `device`, as text
  MethodTarget target;  ///< of `device`, once it is opened
  /// Of frames on a device: reads the one after this, of these inputs.
  std::shared_ptr<NextFrame> next_frame;
  std::vector<std::string> inputs_of_next;
  std::shared_ptr<const History> history;  ///< of the frame being denoised
  DenoiseOptions denoiser() const { return {oidn}; }
  DenoisingChoice mixing() const {
    return {mode.empty() ? default_denoising(kDefaultEstimator) : mode, oidn, {history}};
  }
};

/// One picture of the inputs: what is denoised, and where the result goes.
struct DenoiseTask {
  Picture picture;    ///< what the result replaces
  std::string layer;  ///< what is denoised: the picture, or the render before Cycles denoised it
  bool is_only = true;
  std::string text() const {
    return is_only ? "" : fmt::format(" ({})", picture.layer.empty() ? "R G B" : picture.layer);
  }
  std::string prefix() const { return is_only || picture.layer.empty() ? "" : picture.layer + "."; }
};

/// A denoised picture, and what to say about it.
struct Denoised {
  ResultPicture result;
  std::map<std::string, std::string> attributes;
  std::optional<PredictedError> predicted;
  nlohmann::ordered_json json;
  std::function<void()> report;
};

/// What is denoised: the picture of each view and view layer, if none is named.
std::vector<DenoiseTask> tasks_of(const DenoiseCommand& o);

/// By Open Image Denoise alone.
Denoised denoise_by_network(const DenoiseCommand& o, const DenoiseTask& task, ProgressLine& progress);
/// By a mixture of denoised images, of two groups or more.
Denoised denoise_by_mixture(const DenoiseCommand& o, const DenoiseTask& task, const FrameFile& frame,
                            ProgressLine& progress);

}  // namespace covary
