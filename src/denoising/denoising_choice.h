// SPDX-License-Identifier: Apache-2.0
// How an image is denoised, as text, as on the command line.
#pragma once

#include <memory>
#include <string>

namespace covary {

struct History;  // denoising/history.h

/// The history of a frame of a sequence. Mixed in if there are enough samples for a mixture; layers do not use it.
struct MixingHistory {
  std::shared_ptr<const History> before;  ///< made of the previous frame; or null
  bool keep_samples = false;              ///< fill EstimatorResult::kept_samples for the next frame
  bool is_used() const { return before || keep_samples; }
};

struct DenoisingChoice {
  static constexpr const char *kNone = "none", *kAuto = "auto";
  std::string mode = kNone;    ///< none; auto, error: least error; bias, balanced: less bias, and more noise
  std::string oidn = {};       ///< Open Image Denoise's library or its folder; "": search for it, "off": do not use it
  MixingHistory history = {};  ///< not an option
  bool denoises() const { return mode != kNone; }
  bool uses_oidn() const { return denoises() && oidn != "off"; }
};

}  // namespace covary
