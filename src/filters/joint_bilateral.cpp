// SPDX-License-Identifier: Apache-2.0
#include "filters/joint_bilateral.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/parallel.h"

namespace covary {
namespace {

constexpr int kRadius = 8;
constexpr float kSpatial = 4, kAlbedo = 0.1f, kNormal = 0.3f;  // standard deviations

float difference_squared(const float* a, const float* b) {
  return sqr(a[0] - b[0]) + sqr(a[1] - b[1]) + sqr(a[2] - b[2]);
}

bool same_size(const Image& a, const Image& b) {
  return a.width == b.width && a.height == b.height && a.channels == 3 && b.channels == 3;
}

}  // namespace

Image joint_bilateral(const Image& rgb, const Image& albedo, const Image& normal) {
  if (!same_size(rgb, albedo) || !same_size(rgb, normal))
    throw Error(ErrorCode::kInput, "the joint bilateral filter needs image, albedo and normal of one size");
  Image result(rgb.width, rgb.height, 3);
  parallel_for(rgb.height, [&](int y) {
    for (int x = 0; x < rgb.width; ++x) {
      double sum[3] = {0, 0, 0}, weights = 0;
      for (int ny = std::max(y - kRadius, 0); ny <= std::min(y + kRadius, rgb.height - 1); ++ny)
        for (int nx = std::max(x - kRadius, 0); nx <= std::min(x + kRadius, rgb.width - 1); ++nx) {
          const float* value = rgb.pixel(nx, ny);
          const float exponent = static_cast<float>(sqr(nx - x) + sqr(ny - y)) / (2 * sqr(kSpatial)) +
                                 difference_squared(albedo.pixel(x, y), albedo.pixel(nx, ny)) / (2 * sqr(kAlbedo)) +
                                 difference_squared(normal.pixel(x, y), normal.pixel(nx, ny)) / (2 * sqr(kNormal));
          if (!std::isfinite(value[0] + value[1] + value[2]) || !(exponent < 20)) continue;
          const double weight = std::exp(-exponent);
          for (int c = 0; c < 3; ++c) sum[c] += weight * value[c];
          weights += weight;
        }
      for (int c = 0; c < 3; ++c) result.pixel(x, y)[c] = weights > 0 ? static_cast<float>(sum[c] / weights) : 0;
    }
  });
  return result;
}

}  // namespace covary
