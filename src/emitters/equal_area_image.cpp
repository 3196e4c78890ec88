// SPDX-License-Identifier: Apache-2.0
#include "emitters/equal_area_image.h"

#include <fmt/format.h>

#include <cmath>

#include "core/equal_area.h"
#include "core/error.h"

namespace covary {
EqualAreaImage::EqualAreaImage(TexelImage image, float scale, bool mis_compensation)
    : image_(std::move(image)), compensated_(mis_compensation) {
  if (image_.width != image_.height)
    throw Error(ErrorCode::kInput, fmt::format("an image of equal areas is square, but this one has {} x {} pixels",
                                               image_.width, image_.height));
  COVARY_CHECK(image_.channels == 3 && image_.floats.size() == image_.n_pixels() * 3 && image_.width > 0,
               "an environment needs a linear RGB image");
  std::vector<float> weights(image_.n_pixels());
  double integral[3] = {0, 0, 0}, mean = 0;
  for (size_t i = 0; i < weights.size(); ++i) {
    Spectrum value;
    for (int c = 0; c < 3; ++c) {
      float& texel = image_.floats[3 * i + c];
      value[c] = texel *= scale;
      integral[c] += texel;
    }
    weights[i] = std::max(luminance(value), 0.0f);
    mean += weights[i];
  }
  const double n = static_cast<double>(weights.size());
  for (int c = 0; c < 3; ++c) integral_[c] = static_cast<float>(integral[c] * 4 * M_PI / n);
  mean /= n;
  if (mis_compensation) {
    const bool uneven = std::any_of(weights.begin(), weights.end(), [&](float w) { return w > mean; });
    for (float& weight : weights)
      if (uneven) weight = std::max(weight - static_cast<float>(mean), 0.0f);
  }
  if (mean > 0) texels_ = PiecewiseConstant2D(weights, image_.width, image_.height);
}

Spectrum EqualAreaImage::at(Vec2 uv) const {
  const auto place = [&](float u) {
    return std::min(static_cast<int>(u * static_cast<float>(image_.width)), image_.width - 1);
  };
  const float* rgb = image_.floats.data() + (static_cast<size_t>(place(uv.y)) * image_.width + place(uv.x)) * 3;
  return {rgb[0], rgb[1], rgb[2]};
}

EqualAreaImage::Lookup EqualAreaImage::lookup(const Vec3& d) const {
  const Vec2 uv = equal_area_square(d);
  const float density = texels_.width() > 0 ? texels_.pdf(uv) : 0;
  return {at(uv), density / (4 * kPi)};
}

EqualAreaImage::Sample EqualAreaImage::sample(Vec2 u) const {
  if (texels_.width() == 0) return {{0, 0, 1}, Spectrum(0), 0};
  const auto place = texels_.sample(u);
  return {equal_area_direction(place.uv), at(place.uv), place.pdf / (4 * kPi)};
}

TexelImage latitude_longitude_of(const TexelImage& equal_area) {
  TexelImage result;
  result.width = 2 * equal_area.width, result.height = equal_area.width + 1, result.channels = 3;
  std::vector<double> sums(result.n_pixels() * 4);
  // Splats points of equal solid angle into the four nearest texels with their interpolation weights: a constant map
  // stays constant, and the total light changes by about a thousandth.
  constexpr int kPoints = 6;  // per texel side
  const float step = 1.0f / static_cast<float>(kPoints * equal_area.width);
  for (int y = 0; y < kPoints * equal_area.width; ++y) {
    for (int x = 0; x < kPoints * equal_area.width; ++x) {
      const float* rgb =
          equal_area.floats.data() + (static_cast<size_t>(y / kPoints) * equal_area.width + x / kPoints) * 3;
      const Vec3 d =
          equal_area_direction({(static_cast<float>(x) + 0.5f) * step, (static_cast<float>(y) + 0.5f) * step});
      const double u = std::atan2(d.x, -d.z) / (2 * M_PI), v = std::acos(std::clamp(d.y, -1.0f, 1.0f)) / M_PI;
      const double column = (u - std::floor(u)) * result.width - 0.5, row = v * (result.height - 1);
      const double left = std::floor(column), top = std::min(std::floor(row), result.height - 2.0);
      for (int k = 0; k < 4; ++k) {
        const double weight = std::abs(1 - k % 2 - (column - left)) * std::abs(1 - k / 2 - (row - top));
        const int i = (static_cast<int>(left) + k % 2 + result.width) % result.width, j = static_cast<int>(top) + k / 2;
        double* sum = &sums[4 * (static_cast<size_t>(j) * result.width + i)];
        for (int c = 0; c < 3; ++c) sum[c] += weight * rgb[c];
        sum[3] += weight;
      }
    }
  }
  result.floats.resize(result.n_pixels() * 3);
  for (size_t i = 0; i < result.n_pixels(); ++i)
    for (size_t c = 0; c < 3; ++c)
      result.floats[3 * i + c] = static_cast<float>(sums[4 * i + c] / std::max(sums[4 * i + 3], 1e-30));
  return result;
}

}  // namespace covary
