// SPDX-License-Identifier: Apache-2.0
// Frames of any renderer as files, in_####.exr: what `denoise` and `combine` do with images, one frame after the other,
// each with the history of the frame before.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "denoising/history.h"
#include "sequences/motion_file.h"

namespace covary {

struct FrameOptions {
  std::string frames, motion_scale;
  MotionSource motion;
  bool no_history = false;
};

/// --frames, --motion, --depth, --motion-scale, --no-history. `what`: "Denoise".
void add_frame_options(CLI::App& command, FrameOptions& options, const std::string& what);

/// The numbers that --frames tells or, where that is empty, those of the files there are of the pattern. Throws
/// Error(kUsage), and Error(kInput) where there are none.
std::vector<int> frames_of(const std::string& frames, const std::string& pattern);

/// The file of a frame; where the path has no '#', or is a file's whole name, that of all frames.
std::string file_of_frame(const std::string& path, int frame);

/// Files of frames, by patterns.
struct FramePatterns {
  std::vector<std::string> images;  ///< each with samples of its own
  std::vector<std::string> others;  ///< that may have motion, too, or be no patterns
  std::string output;
  std::string layer;  ///< of the first image
};

/// Whether the first image is a pattern. Throws Error(kUsage) where other images or the output are not, or where
/// options are given that images alone do not have.
bool are_frames(const FrameOptions& options, const FramePatterns& patterns);

/// Calls `run` with the number of each frame, and the history of the frame before where that was run just before. The
/// motion is that of the first file that has the layer. Throws Error(kInput) where motion does not lead to where things
/// are, or frames have one seed, whose errors no samples of theirs could tell.
void for_each_frame(const FrameOptions& options, const FramePatterns& patterns, bool has_history,
                    const std::function<void(int frame, std::shared_ptr<const History> history)>& run);

}  // namespace covary
