// SPDX-License-Identifier: Apache-2.0
#include "report/image_block.h"

#include <Imath/half.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/error.h"

namespace covary {
namespace {

constexpr int kCompressionLevel = 6;  // level 9 saves 1 % on rendered images and takes four times as long
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
  const int width = image.width;
  const size_t n_values = image.data.size();
  std::vector<uint8_t> bytes(n_values * 2);
  std::vector<int16_t> row(width), above(width);
  size_t i = 0;
  for (int c = 0; c < image.channels; ++c)
    for (int y = 0; y < image.height; ++y) {
      for (int x = 0; x < width; ++x, ++i) {
        const float* pixel = image.pixel(x, y);
        row[x] = static_cast<int16_t>(half_bits(pixel[c]) - (c > 0 ? half_bits(pixel[c - 1]) : 0));
        const int suggested = x > 0 && y > 0 ? (row[x - 1] + above[x]) >> 1 : x > 0 ? row[x - 1] : y > 0 ? above[x] : 0;
        const auto d = static_cast<int16_t>(row[x] - suggested);
        const auto z = static_cast<uint16_t>(d >= 0 ? 2 * d : -2 * d - 1);
        bytes[i] = static_cast<uint8_t>(z >> 8);
        bytes[n_values + i] = static_cast<uint8_t>(z & 0xff);
      }
      std::swap(row, above);
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
