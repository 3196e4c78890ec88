// SPDX-License-Identifier: Apache-2.0
// Image files as textures and environment maps need them: grey or RGB, alpha dropped, as bytes where the file has
// bytes.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace covary {

/// Pixels row by row from the top of the picture, channels interleaved. Exactly one of `bytes` and `floats` is filled
/// in.
struct TexelImage {
  int width = 0, height = 0;
  int channels = 0;            ///< 1 (grey) or 3 (RGB)
  std::vector<uint8_t> bytes;  ///< of files with 8 bits per channel, as they stand in the file
  std::vector<float> floats;   ///< of all other files, integers scaled to [0, 1]
  bool srgb = false;           ///< values are encoded with the sRGB curve (integer formats); floating point is linear

  size_t n_pixels() const { return static_cast<size_t>(width) * height; }
};

/// Reads the first picture of a file in any format OpenImageIO knows (PNG, JPEG, EXR, HDR, PFM, TGA, BMP, PPM, TIFF).
/// Throws like open_image() (imageio/image_io.h), and Error(kInput) when the file is damaged, has neither red, green
/// and blue nor grey channels, or holds a value that is not finite.
TexelImage read_texels(const std::string& path);

/// The image as linear RGB floats, three per pixel; throws like read_texels.
TexelImage read_linear_rgb(const std::string& path);

/// An image that stands in a scene's own file (scene/embedded_data.h): binary PGM or PPM of 8 bits, which have sRGB
/// values, or PFM of little-endian floats. Throws Error(kInput) for anything else, and for values that are not finite.
TexelImage read_embedded_image(std::string_view bytes);

}  // namespace covary
