// SPDX-License-Identifier: Apache-2.0
// Writes pictures in the format given by the file name: EXR by OpenEXR, all others by src/imageio.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "film/exr.h"

namespace covary {

/// File extensions that write_image() knows, in lower case: ".exr", ".png", ….
const std::vector<std::string>& image_extensions();

/// The file extension including its dot, in lower case; "" if there is none.
std::string lower_extension(const std::string& path);

/// Writes linear RGB (3 channels), multiplied by `alpha` (1 channel) if there is one, in the format given by the
/// extension; PNG for unknown ones. All but EXR hold the frame.
///   .exr               32-bit floats, with `place`, `attributes` and alpha
///   .tif .tiff         32-bit floats, with alpha
///   .pfm               32-bit floats, on black
///   .hdr               8 bits per channel and a shared exponent, on black; negative values and NaN become 0
///   .png               8-bit sRGB, values clamped to [0, 1], NaN becomes black; colours are divided by alpha first
///   .jpg .jpeg         the same on black, without alpha
/// Without a place, the image is the frame. Throws Error(kIo).
void write_image(const std::string& path, const Image& linear, const ImagePlace& place = {},
                 const std::map<std::string, std::string>& attributes = {}, const Image& alpha = {});

/// The pixels of the frame of an image with any number of channels: 0 where the image has none.
Image framed(const Image& image, const ImagePlace& place);

/// Writes linear RGB, multiplied by `alpha` if there is one, as 8-bit sRGB, values clamped to [0, 1], NaN as black. The
/// text chunk `Software` identifies covary. Throws Error(kIo).
void write_png(const std::string& path, const Image& linear, const Image& alpha = {});

/// n rows of a picture from the first one on, and their alpha (empty: none, for all rows).
using PictureRows = std::function<std::pair<Image, Image>(int first, int n)>;

/// The same, row by row in little memory.
void write_png_rows(const std::string& path, int width, int height, const PictureRows& rows);

/// The EXR file of write_image(), row by row in little memory: asks for all rows in their order twice, first for their
/// checksums. Throws Error(kIo).
void write_exr_rows(const std::string& path, const ImagePlace& place,
                    const std::map<std::string, std::string>& attributes, const PictureRows& rows);

/// Whether the file is a PNG written by write_png().
bool is_own_png(const std::string& path);

}  // namespace covary
