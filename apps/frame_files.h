// SPDX-License-Identifier: Apache-2.0
// Frames of any renderer as files, in_####.exr: `denoise` and `combine` treat them as images, one after the other, each
// with the history of the previous frame.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "denoising/history.h"
#include "film/image_file.h"
#include "film/pictures.h"
#include "sequences/motion_file.h"

namespace covary {

struct FrameOptions {
  std::string frames, motion_scale;
  MotionSource motion;
  bool no_history = false, resume = false, watch = false, quiet = false;
  std::optional<double> idle;  ///< seconds without a new frame after which --watch ends
};

/// --frames, --resume, --watch, --idle, --motion, --depth, --motion-scale, --no-history. `what`: "Denoise".
void add_frame_options(CLI::App& command, FrameOptions& options, const std::string& what);

/// The frame numbers of --frames or, if that is empty, those of the pattern's existing files. Throws Error(kUsage), and
/// Error(kInput) if there are none.
std::vector<int> frames_of(const std::string& frames, const std::string& pattern);

/// The file of a frame; if the path has no '#', or a file has exactly this name, the file of all frames.
std::string file_of_frame(const std::string& path, int frame);

/// A note on stderr if numbers between the first and last frame of `pattern` are missing.
void note_gaps(const std::string& pattern, const std::vector<int>& frames);

/// Files of frames, by patterns.
struct FramePatterns {
  std::vector<std::string> images;  ///< each with its own samples
  std::vector<std::string> others;  ///< that may contain motion, too, or may not be patterns
  std::string output;
  PictureChoice choice;  ///< in the first image
  std::string made_by;   ///< the attribute "covary:estimator" of results with the same settings, if they have it
};

/// Whether the first image is a pattern. Throws Error(kUsage) if other images or the output are not, or for options of
/// single images.
bool are_frames(const FrameOptions& options, const FramePatterns& patterns);

/// Calls `run` with the number of each frame, and the history of the previous frame if that was run just before; it
/// returns what to say about the frame. Prints a line for each frame, and one for all in the end. The motion comes from
/// the first file that has the layer; without any, and for files with several pictures, there is no history. Before the
/// first frame, throws Error(kInput) if files are missing, unreadable, or of another size or channels than most
/// frames; --resume leaves out frames that are, or are unfinished. A frame whose call throws Error(kInput) is left
/// out; the next one starts a new history. Error(kInput) names all left out in the end. --watch waits for them. Throws
/// Error(kInput) at once if the motion does not match, or if frames share a seed, which hides shared errors.
void for_each_frame(const FrameOptions& options, const FramePatterns& patterns, bool has_history,
                    const std::function<std::string(int frame, std::shared_ptr<const History> history)>& run);

}  // namespace covary
