// SPDX-License-Identifier: Apache-2.0
// The pixels that crops of one frame have in common.
#pragma once

#include <string>

#include "film/image_file.h"

namespace covary {

/// The part of `window` (of the image `path`) that `other` covers. Throws Error(kInput) naming both files if the frames
/// differ in size or the intersection is empty.
CropWindow common_window(const std::string& path, const ImagePlace& place, const CropWindow& window,
                         const std::string& other_path, const ImagePlace& other);

/// The pixels in `window`, which must lie inside the image's window; 3 channels.
Image cut(const PlacedImage& source, const CropWindow& window);
/// The same for an expiring image: moves instead of copying if the window covers all of it.
Image cut(PlacedImage&& source, const CropWindow& window);

/// "640 x 360 at (10, 20)"
std::string text_of(const CropWindow& window);

}  // namespace covary
