// SPDX-License-Identifier: Apache-2.0
// File names of sequences. A run of '#' stands for the frame number, padded to at least that many digits:
// "out_####.exr" means out_0001.exr, out_0002.exr, …; so do "out_%04d.exr" and "out_<frame>.exr".
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

/// Whether the last component of the path has a place for the number.
bool is_frame_pattern(const std::string& pattern);

/// The same for an input, whose number may also be in a folder's name: "passes_####/crn.exr". False if a file has
/// exactly that name, but for '#' in the last component.
bool is_frame_pattern_of_input(const std::string& pattern);

/// The path of a frame. Throws Error(kUsage) if the pattern has no place for the number.
std::string frame_name(const std::string& pattern, int frame);

/// Frame numbers of the existing files, ascending; `others`: names that differ in their number's digits or sign ("998"
/// beside "####"), which are not frames; may be null. Throws like frame_name(), and Error(kIo) if the folder cannot be
/// read.
std::vector<int> frames_on_disk(const std::string& pattern, std::vector<std::string>* others = nullptr);

}  // namespace covary
