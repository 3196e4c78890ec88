// SPDX-License-Identifier: Apache-2.0
// Files of a sequence: one name with a run of '#' for the frame number, as many digits at least as there are
// '#': "out_####.exr" stands for out_0001.exr, out_0002.exr, …
#pragma once

#include <string>
#include <vector>

namespace covary {

/// Frames first … last, every `step`th.
struct FrameRange {
  int first = 0, last = 0, step = 1;
  std::vector<int> numbers() const;
};

/// Reads "7", "1-48" or "1-48:2"; false where the text is none of these, or a number is above 999,999.
bool read_frame_range(const std::string& text, FrameRange& range);

/// Whether there is a run of '#' in the last part of the path.
bool is_frame_pattern(const std::string& pattern);

/// The same of a file to read, which may also lie in folders of frames: "passes_####/crn.exr". A file of just that name
/// is none.
bool is_frame_pattern_of_input(const std::string& pattern);

/// The file of a frame: the last run of '#' is replaced. Throws Error(kUsage) where there is none.
std::string frame_name(const std::string& pattern, int frame);

/// The numbers of the frames whose files are there, ascending. Throws like frame_name(), and Error(kIo) where the
/// folder cannot be read.
std::vector<int> frames_on_disk(const std::string& pattern);

}  // namespace covary
