// SPDX-License-Identifier: Apache-2.0
// Pictures out, in the format that their name tells: EXR by OpenEXR, all others by src/imageio.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "film/exr.h"

namespace covary {

/// The ends of names that write_image() knows, in lower case: ".exr", ".png", ….
const std::vector<std::string>& image_extensions();

/// The end of a file name from its last dot on, in lower case; "" without one.
std::string lower_extension(const std::string& path);

/// Writes linear RGB (3 channels) in the format that the name's end tells; PNG where it tells none.
///   .exr               32-bit floats, with `place` and `attributes`
///   .pfm .tif .tiff    32-bit floats
///   .hdr               8 bits per channel and a common exponent; below 0 and not-a-number as 0
///   .png .jpg .jpeg    8-bit sRGB, values clamped to [0, 1], not-a-number as black
/// Throws Error(kIo).
void write_image(const std::string& path, const Image& linear, const ImagePlace& place,
                 const std::map<std::string, std::string>& attributes);

/// Writes linear RGB as 8-bit sRGB, values clamped to [0, 1], not-a-number as black. The text chunk `Software` says
/// that covary made it. Throws Error(kIo).
void write_png(const std::string& path, const Image& linear);

/// Whether the file is a PNG that write_png() wrote.
bool is_own_png(const std::string& path);

}  // namespace covary
