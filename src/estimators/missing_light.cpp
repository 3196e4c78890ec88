// SPDX-License-Identifier: Apache-2.0
#include "estimators/missing_light.h"

#include <algorithm>

#include "core/parallel.h"
#include "filters/filter_input.h"

namespace covary {
namespace {

using namespace lanes;

/// Squared: how many standard deviations a difference must have to be beyond noise.
constexpr float kSignificant = 9;
/// The same where the CRN image does not tell its own noise: of K bright pixels alone, a difference has K.
constexpr float kLeastSignificant = 2;
/// Least variance of a CRN pixel, relative to that of an independent one, that is believed.
constexpr float kCredible = 0.01f;
/// Squared: differences between pixels that are alike, relative to the missing light.
constexpr float kAlike = 1.0f / 16;

/// tau^2 of missing_light.h.
Planes tolerance(const Moments& g, const Moments& h, const std::vector<unsigned char>& valid) {
  const int width = h.mean.width(), height = h.mean.height();
  Planes difference(width, height, 1, 0, 0), variance(width, height, 1, 0, 0);
  parallel_for(height, 8, [&](int y) {
    for (int x = 0; x < width; ++x) {
      if (!valid[static_cast<size_t>(y) * width + x]) continue;
      for (int c = 0; c < 3; ++c) {
        difference.row(0, y)[x] += h.mean.row(c, y)[x] - g.mean.row(c, y)[x];
        variance.row(0, y)[x] += h.variance_of_mean.row(c, y)[x];
      }
    }
  });
  Planes result = box_mean(difference, valid, kMissingWindow, 0, 0);
  const Planes noise = box_mean(variance, valid, kMissingWindow, 0, 0);
  constexpr float kPixels = kMissingWindow * kMissingWindow;
  parallel_for(height, 8, [&](int y) {
    for (int x = 0; x < width; ++x) {
      const float d = result.row(0, y)[x];
      // The sum of three channels: of grey, three times the squared norm and the summed variance.
      result.row(0, y)[x] = kAlike / 3 * std::max(0.0f, d * d - 3 * noise.row(0, y)[x] / kPixels);
    }
  });
  return result;
}

/// D of missing_light.h, and summed over RGB its variance v and the variance V of a pixel of h.
struct Difference {
  vfloat mean[3] = {}, variance = {}, of_pixel = {};
};

Difference guided_difference(const Moments& g, const Moments& h, int x, int y, vfloat squared_bandwidth) {
  const vfloat factor = -1.0f / max(squared_bandwidth, splat(1e-30f));
  const vfloat centre[3] = {load(g.mean.row(0, y) + x), load(g.mean.row(1, y) + x), load(g.mean.row(2, y) + x)};
  constexpr int kRadius = kMissingWindow / 2;
  Difference sum;
  vfloat weights = {};
  for (int dy = -kRadius; dy <= kRadius; ++dy)
    for (int dx = -kRadius; dx <= kRadius; ++dx) {
      vfloat q[3], distance = {};
      for (int c = 0; c < 3; ++c) {
        q[c] = load(g.mean.row(c, y + dy) + x + dx);
        distance += (q[c] - centre[c]) * (q[c] - centre[c]);
      }
      vfloat w = exp_of_nonpositive(distance * factor);
      if (h.relative_count) w *= load(h.relative_count->row(0, y + dy) + x + dx);
      weights += w;
      vfloat variance = {};
      for (int c = 0; c < 3; ++c) {
        sum.mean[c] += w * (load(h.mean.row(c, y + dy) + x + dx) - q[c]);
        variance += load(h.variance_of_mean.row(c, y + dy) + x + dx);
      }
      sum.variance += w * w * variance;
      sum.of_pixel += w * variance;
    }
  for (vfloat& m : sum.mean) m /= weights;
  sum.variance /= weights * weights;
  sum.of_pixel /= weights;
  return sum;
}

}  // namespace

Planes missing_light(const Moments& g, const Moments& h, const std::vector<unsigned char>& valid, int border) {
  const int width = h.mean.width(), height = h.mean.height();
  Planes result(width, height, 3, border, 0);
  const Planes alike = tolerance(g, h, valid);
  for_each_batch(width, height, [&](int x, int y, int n) {
    vfloat own = {};
    for (int c = 0; c < 3; ++c) own += load(g.variance_of_mean.row(c, y) + x);
    const Difference d = guided_difference(g, h, x, y, own + load(alike.row(0, y) + x));
    const vfloat squares = d.mean[0] * d.mean[0] + d.mean[1] * d.mean[1] + d.mean[2] * d.mean[2];
    const vfloat known = min(own / max(kCredible * d.of_pixel, splat(1e-30f)), splat(1));
    const vfloat noise = max(kSignificant * known, splat(kLeastSignificant)) * (own + d.variance);
    const vfloat beyond = lanes::sqrt(max(1.0f - noise / max(squares, splat(1e-30f)), vfloat{}));
    const vfloat brighter = d.mean[0] + d.mean[1] + d.mean[2] > 0.0f ? beyond : vfloat{};
    const vfloat part = own > 0.0f ? brighter : splat(1);
    for (int l = 0; l < n; ++l)
      if (valid[static_cast<size_t>(y) * width + x + l])
        for (int c = 0; c < 3; ++c) result.row(c, y)[x + l] = part[l] * d.mean[c][l];
  });
  return result;
}

}  // namespace covary
