// SPDX-License-Identifier: Apache-2.0
// PNG files by libpng: quick to load, other than the module behind image_io.h.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace covary {

class ImageReader;

/// The pixels that OpenImageIO reads of a PNG file, to the same bits; without attributes. nullptr where it is not a PNG
/// file, damaged or interlaced.
std::unique_ptr<ImageReader> open_plain_png(const std::string& path);

/// The content of a PNG file of `width` x `height` pixels, three bytes each from the top left on, encoded with the sRGB
/// curve. `texts` become text chunks: keywords of 1 to 79 Latin-1 characters, UTF-8 values. Throws Error(kIo) when
/// libpng refuses the size or a keyword.
std::vector<unsigned char> encode_png(int width, int height, const std::vector<uint8_t>& rgb,
                                      const std::map<std::string, std::string>& texts = {});

/// The text chunks of a PNG file; none when the file does not exist or is not a PNG file that can be read.
std::map<std::string, std::string> read_png_texts(const std::string& path);

}  // namespace covary
