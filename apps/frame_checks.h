// SPDX-License-Identifier: Apache-2.0
// What is wrong with the files of frames, before the first frame is spent.
#pragma once

#include <string>
#include <vector>

#include "film/image_file.h"
#include "frame_files.h"

namespace covary {

/// Whether the file says that its render was interrupted.
bool is_unfinished(const ImageInfo& image);
/// Warns of images that say so. Throws like inspect_image().
void warn_of_unfinished(const std::vector<std::string>& inputs);

/// All files of frames that are read, as patterns.
std::vector<std::string> read_patterns(const FramePatterns& patterns);

/// Takes frames out that a farm has not finished, and returns them.
std::vector<int> take_unfinished(std::vector<int>& frames, const FramePatterns& patterns);

/// "b_0003.exr is missing, a_0005.exr is unfinished": the files for which these frames were taken out.
std::string text_of_unfinished(const std::vector<int>& frames, const FramePatterns& patterns);

/// Reads the headers of all files. Takes frames with problems out, with a warning, and returns them. Throws
/// Error(kInput) naming the first problems without --resume, or if most frames have some.
std::vector<int> take_unfit(const FrameOptions& options, std::vector<int>& frames, const FramePatterns& patterns);

}  // namespace covary
