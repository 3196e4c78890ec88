// SPDX-License-Identifier: Apache-2.0
// Where the history of frames of files comes from: motion in the frames, and the result of the frame before.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "denoising/history.h"
#include "sequences/motion_file.h"

namespace covary {

struct FrameOptions;
struct FramePatterns;

/// --motion, --depth and --motion-scale. Throws Error(kUsage).
MotionSource motion_source(const FrameOptions& options);

/// The pattern of the files that contain motion; nullopt if none does, and the user did not name its layer.
std::optional<std::string> motion_pattern(const MotionSource& source, const FramePatterns& patterns, int frame);

/// What the history of frames is read from.
struct HistorySource {
  std::optional<std::string> motion;  ///< pattern of the files with motion; none: there is no history
  std::string layer;                  ///< of the pictures

  /// Looks at the first frame; prints a note if the frames of a command that `has_history` have none.
  HistorySource(const FrameOptions& options, const FramePatterns& patterns, const std::vector<int>& frames,
                bool has_history);
};

/// The history of the frame, from the result of the frame before. Throws like read_image(), check_seeds() and
/// check_motion().
std::shared_ptr<const History> history_of(const HistorySource& from, const MotionSource& source,
                                          const FramePatterns& patterns, int frame);

/// Why the result of a frame is not what it would be after the present one of the frame before; "" if it is.
std::string outdated(const FramePatterns& patterns, int frame);

}  // namespace covary
