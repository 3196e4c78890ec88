// SPDX-License-Identifier: Apache-2.0
// The options of a rendered sequence, declared once (settings/settings.h).
#pragma once

#include <optional>
#include <string>

#include "sequences/frame_names.h"
#include "settings/settings.h"

namespace covary {

struct SequenceSettings {
  std::string camera_path;  ///< JSON file (plans/camera_path.h); empty: the camera stands still
  std::optional<FrameRange> frames;
  double frames_per_second = 0;  ///< frame n is at time n / this; 0: that of the camera path, or 1
  bool history = false;          ///< mix in previous frames

  bool is_sequence() const { return frames.has_value(); }
  /// The seed of a frame is the command's plus this: those of all frames of all commands with seeds below 1,000,000 are
  /// distinct.
  static uint64_t seed_offset(int frame) { return static_cast<uint64_t>(frame) * 1'000'000; }
};

/// Throws Error(kUsage) for a camera path without frames.
void declare(Settings& settings, SequenceSettings& sequence);

}  // namespace covary
