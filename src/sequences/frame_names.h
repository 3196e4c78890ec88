// SPDX-License-Identifier: Apache-2.0
// File names of sequences. A run of '#' stands for the frame number, padded to at least that many digits:
// "out_####.exr" means out_0001.exr, out_0002.exr, …
#pragma once

#include <string>
#include <vector>

namespace covary {

/// Frames first, first + step, … up to last.
struct FrameRange {
  int first = 0, last = 0, step = 1;
  std::vector<int> numbers() const;
};

/// Parses "7", "1-48" or "1-48:2"; false if the text is none of these, or a number is above 999,999.
bool read_frame_range(const std::string& text, FrameRange& range);

/// Whether the last component of the path contains a run of '#'.
bool is_frame_pattern(const std::string& pattern);

/// The same for an input, whose '#' may also be in a folder's name: "passes_####/crn.exr". False if a file has exactly
/// that name.
bool is_frame_pattern_of_input(const std::string& pattern);

/// The path of a frame: replaces the last run of '#'. Throws Error(kUsage) if there is none.
std::string frame_name(const std::string& pattern, int frame);

/// Frame numbers of the existing files, ascending. Throws like frame_name(), and Error(kIo) if the folder cannot be
/// read.
std::vector<int> frames_on_disk(const std::string& pattern);

}  // namespace covary
