// SPDX-License-Identifier: Apache-2.0
#include "report/image_block.h"

#include <Imath/half.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace covary {
namespace {

constexpr int kCompressionLevel = 6;  // level 9 makes rendered images 1 % smaller and takes four times as long
constexpr float kLargestHalf = 65504;

std::vector<uint8_t> deflated(const std::vector<uint8_t>& bytes) {
  uLongf size = compressBound(bytes.size());
  std::vector<uint8_t> result(size);
  const int status = compress2(result.data(), &size, bytes.data(), bytes.size(), kCompressionLevel);
  COVARY_CHECK(status == Z_OK, "zlib cannot compress an image");
  result.resize(size);
  return result;
}

}  // namespace

uint16_t half_bits(float value) {
  if (std::isfinite(value)) value = std::clamp(value, -kLargestHalf, kLargestHalf);
  return Imath::half(value).bits();
}

std::vector<uint8_t> predicted_halves(const Image& image) {
  const size_t n_values = image.data.size();
  std::vector<uint8_t> bytes(n_values * 2);
  size_t i = 0;
  for (int c = 0; c < image.channels; ++c) {
    uint16_t row_start = 0;
    for (int y = 0; y < image.height; ++y) {
      uint16_t previous = row_start;
      for (int x = 0; x < image.width; ++x, ++i) {
        const uint16_t bits = half_bits(image.pixel(x, y)[c]);
        const auto difference = static_cast<uint16_t>(bits - previous);
        bytes[i] = static_cast<uint8_t>(difference >> 8);
        bytes[n_values + i] = static_cast<uint8_t>(difference & 0xff);
        if (x == 0) row_start = bits;
        previous = bits;
      }
    }
  }
  return bytes;
}

std::string base64(const std::vector<uint8_t>& bytes) {
  static constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (size_t i = 0; i < bytes.size(); i += 3) {
    const size_t n = std::min<size_t>(3, bytes.size() - i);
    const uint32_t three =
        uint32_t{bytes[i]} << 16 | (n > 1 ? uint32_t{bytes[i + 1]} << 8 : 0) | (n > 2 ? uint32_t{bytes[i + 2]} : 0);
    for (size_t digit = 0; digit < 4; ++digit) text += digit <= n ? kDigits[three >> (18 - 6 * digit) & 63] : '=';
  }
  return text;
}

std::string encode_image(const Image& image) { return base64(deflated(predicted_halves(image))); }

}  // namespace covary
