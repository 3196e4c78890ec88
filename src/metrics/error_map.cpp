// SPDX-License-Identifier: Apache-2.0
#include "metrics/error_map.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "film/image_file.h"

namespace covary {
namespace {

/// sRGB colours along a path through Oklab: lightness rises linearly from 0.10 to 0.97 while the hue goes from blue
/// through violet and red to yellow; chroma is the largest in gamut, at most 0.24.
constexpr std::array<uint32_t, 33> kColours{
    0x020212, 0x050121, 0x0d002e, 0x170039, 0x210042, 0x2c004b, 0x380052, 0x450158, 0x53015d, 0x610060, 0x6f0162,
    0x7d0163, 0x8c0063, 0x9b0061, 0xaa015d, 0xba0258, 0xc90350, 0xd90346, 0xe80436, 0xf12927, 0xf83f10, 0xfb5701,
    0xfc6c03, 0xfe7c01, 0xff8d18, 0xff9d2c, 0xffac3e, 0xfeba50, 0xfbc96b, 0xf8d686, 0xf6e3a2, 0xf6eebe, 0xf8f7db};

float channel(uint32_t colour, int c) { return static_cast<float>((colour >> (16 - 8 * c)) & 0xff) / 255; }

}  // namespace

std::span<const uint32_t> error_colours() { return kColours; }

std::string ErrorScale::legend() const {
  constexpr std::array<const char*, 5> kNames{"black", "violet", "red", "orange", "pale yellow"};
  std::string text;
  for (int i = 0; i < 5; ++i) {
    const double t = i / 4.0;
    const double value = logarithmic ? low * std::pow(high / low, t) : low + t * (high - low);
    text += fmt::format("{}{:.3g} {}", i ? ", " : "", value, kNames[i]);
  }
  return text + (logarithmic ? " (logarithmic)" : " (linear)");
}

ErrorScale decade_scale(std::span<const Image> maps) {
  std::vector<float> values;
  for (const Image& map : maps)
    std::copy_if(map.data.begin(), map.data.end(), std::back_inserter(values),
                 [](float v) { return std::isfinite(v) && v > 0; });
  if (values.empty()) return {1e-4, 1, true};
  const auto quantile = [&](double q) {
    const auto it = values.begin() + std::lround(q * static_cast<double>(values.size() - 1));
    std::nth_element(values.begin(), it, values.end());
    return static_cast<double>(*it);
  };
  const double top = std::ceil(std::log10(quantile(0.99)));
  const double bottom = std::clamp(std::floor(std::log10(quantile(0.01))), top - 8, top - 1);
  return {std::pow(10, bottom), std::pow(10, top), true};
}

Image colour_errors(const Image& map, const ErrorScale& scale) {
  Image result(map.width, map.height, 3);
  for (size_t p = 0; p < map.data.size(); ++p) {
    float* target = result.data.data() + p * 3;
    const double error = map.data[p];
    if (std::isnan(error)) {
      target[1] = 1;
      continue;
    }
    double t = scale.logarithmic ? std::log(std::max(error, scale.low) / scale.low) / std::log(scale.high / scale.low)
                                 : (error - scale.low) / (scale.high - scale.low);
    t = std::clamp(t, 0.0, 1.0) * (kColours.size() - 1);
    const size_t i = std::min(static_cast<size_t>(t), kColours.size() - 2);
    for (int c = 0; c < 3; ++c)
      target[c] = srgb_to_linear(lerp(static_cast<float>(t - i), channel(kColours[i], c), channel(kColours[i + 1], c)));
  }
  return result;
}

}  // namespace covary
