// SPDX-License-Identifier: Apache-2.0
#include "filters/joint_bilateral.h"

#include <cmath>

#include "core/error.h"
#include "core/parallel.h"
#include "filters/planes.h"

namespace covary {
namespace {

constexpr int kRadius = 8;
constexpr float kSpatial = 4, kAlbedo = 0.1f, kNormal = 0.3f;  // standard deviations
constexpr int kFeatures = 6, kFinite = 9, kCount = 10;         // planes: features, RGB, 1 or 0: whether RGB is finite

bool same_size(const Image& a, const Image& b) {
  return a.width == b.width && a.height == b.height && a.channels == 3 && b.channels == 3;
}

/// The features, scaled such that a distance d has weight 2^(-d²), and the image; zeros outside.
Planes planes_of(const Image& rgb, const Image& albedo, const Image& normal) {
  Planes planes(rgb.width, rgb.height, kCount, kRadius, 0);
  const auto unit = [](float deviation) { return std::sqrt(0.5f * lanes::kLog2E) / deviation; };
  parallel_for(rgb.height, [&](int y) {
    for (int x = 0; x < rgb.width; ++x) {
      const float* value = rgb.pixel(x, y);
      const bool finite = std::isfinite(value[0] + value[1] + value[2]);
      for (int c = 0; c < 3; ++c) {
        planes.row(c, y)[x] = albedo.pixel(x, y)[c] * unit(kAlbedo);
        planes.row(3 + c, y)[x] = normal.pixel(x, y)[c] * unit(kNormal);
        planes.row(kFeatures + c, y)[x] = finite ? value[c] : 0;
      }
      planes.row(kFinite, y)[x] = finite ? 1 : 0;
    }
  });
  return planes;
}

}  // namespace

Image joint_bilateral(const Image& rgb, const Image& albedo, const Image& normal) {
  if (!same_size(rgb, albedo) || !same_size(rgb, normal))
    throw Error(ErrorCode::kInput, "the joint bilateral filter needs image, albedo and normal of one size");
  const Planes planes = planes_of(rgb, albedo, normal);
  Image result(rgb.width, rgb.height, 3);
  for_each_batch(rgb.width, rgb.height, [&](int x, int y, int n) {
    lanes::vfloat own[kFeatures], sum[kCount - kFeatures] = {};
    for (int c = 0; c < kFeatures; ++c) own[c] = lanes::load(planes.row(c, y) + x);
    for (int dy = -kRadius; dy <= kRadius; ++dy)
      for (int dx = -kRadius; dx <= kRadius; ++dx) {
        const auto at = [&](int c) { return lanes::load(planes.row(c, y + dy) + x + dx); };
        lanes::vfloat exponent =
            lanes::splat(static_cast<float>(dx * dx + dy * dy) * (-0.5f * lanes::kLog2E / sqr(kSpatial)));
        for (int c = 0; c < kFeatures; ++c) {
          const lanes::vfloat difference = own[c] - at(c);
          exponent = lanes::fnma(difference, difference, exponent);
        }
        const lanes::vfloat weight = lanes::exp2_of_nonpositive(exponent) * at(kFinite);
        for (int c = 0; c < 3; ++c) sum[c] = lanes::fma(weight, at(kFeatures + c), sum[c]);
        sum[3] += weight;
      }
    for (int c = 0; c < 3; ++c)
      for (int l = 0; l < n; ++l) result.pixel(x + l, y)[c] = sum[3][l] > 0 ? sum[c][l] / sum[3][l] : 0;
  });
  return result;
}

}  // namespace covary
