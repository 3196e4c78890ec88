// SPDX-License-Identifier: Apache-2.0
// The pixels that images of one frame have in common.
#pragma once

#include <string>

#include "film/image_file.h"

namespace covary {

/// The part of `window` (of the image `path`) that `other` holds, too. Throws Error(kInput), which names both files,
/// when the frames differ in size or nothing is common.
CropWindow common_window(const std::string& path, const ImagePlace& place, const CropWindow& window,
                         const std::string& other_path, const ImagePlace& other);

/// The pixels of `window`, which lies inside the image's own; 3 channels.
Image cut(const PlacedImage& source, const CropWindow& window);
/// The same of an image that is not needed any more: of a whole one, without a copy.
Image cut(PlacedImage&& source, const CropWindow& window);

/// "640 x 360 at (10, 20)"
std::string text_of(const CropWindow& window);

}  // namespace covary
