// SPDX-License-Identifier: Apache-2.0
// Images for textures and environment maps: grey or RGB, alpha dropped, 8-bit values kept as bytes.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace covary {

/// Pixels row by row from the top of the image, channels interleaved. Exactly one of `bytes` and `floats` is filled.
struct TexelImage {
  int width = 0, height = 0;
  int channels = 0;            ///< 1 (grey) or 3 (RGB)
  std::vector<uint8_t> bytes;  ///< of files with 8 bits per channel, as stored
  std::vector<float> floats;   ///< of all other files, integers scaled to [0, 1] except in EXR
  bool srgb = false;           ///< values are sRGB-encoded (integer formats); floating point is linear

  size_t n_pixels() const { return static_cast<size_t>(width) * height; }
};

/// Reads the first image of a file in any format that OpenImageIO supports (PNG, JPEG, HDR, PFM, TGA, BMP, PPM, TIFF),
/// or the picture of an EXR file (imageio/exr_picture.h). Throws like open_image() (imageio/image_io.h), and
/// Error(kInput) if the file is damaged, has neither red, green and blue nor grey channels, or holds a value that is
/// not finite.
TexelImage read_texels(const std::string& path);

/// pbrt's grey values of an image: alpha, if the image has colours and an alpha that is not 1 everywhere, otherwise the
/// mean of linear red, green and blue. Integers are sRGB-encoded, alpha too, unless they are `raw`. Throws like
/// read_texels.
TexelImage read_alpha_or_mean(const std::string& path, bool raw);

/// The image as linear RGB floats, three per pixel; throws like read_texels.
TexelImage read_linear_rgb(const std::string& path);

/// An image embedded in a scene file (scene/embedded_data.h): 8-bit binary PGM or PPM, sRGB-encoded, or little-endian
/// PFM. Throws Error(kInput) for anything else, and for values that are not finite.
TexelImage read_embedded_image(std::string_view bytes);

}  // namespace covary
