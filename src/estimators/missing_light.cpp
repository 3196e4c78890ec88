// SPDX-License-Identifier: Apache-2.0
#include "estimators/missing_light.h"

#include <algorithm>

#include "core/parallel.h"
#include "filters/filter_input.h"
#include "filters/window_sums.h"

namespace covary {
namespace {

using namespace lanes;

/// Squared number of standard deviations by which a difference must exceed noise.
constexpr float kSignificant = 9;
/// Same where the CRN image does not tell its own noise: a difference due to K bright pixels alone reaches K.
constexpr float kMinSignificant = 2;
/// Smallest credible variance of a CRN pixel, relative to that of an independent one.
constexpr float kCredible = 0.01f;
/// Squared difference tolerated between similar pixels, relative to the missing light.
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
      // d sums three channels: for grey, d^2 is three times the squared norm, and 3 noise three times the summed
      // variance.
      result.row(0, y)[x] = kAlike / 3 * std::max(0.0f, d * d - 3 * noise.row(0, y)[x] / kPixels);
    }
  });
  return result;
}

/// D of missing_light.h; its variance v and the variance V of a pixel of h, both summed over RGB.
struct Difference {
  vfloat mean[3], variance, of_pixel;
};

/// `variance_of_h`: one plane, summed over RGB.
Difference guided_difference(const Moments& g, const Moments& h, const Planes& variance_of_h, int x, int y,
                             vfloat squared_bandwidth) {
  const vfloat centre[3] = {load(g.mean.row(0, y) + x), load(g.mean.row(1, y) + x), load(g.mean.row(2, y) + x)};
  vfloat m0 = {}, m1 = {}, m2 = {}, variance = {}, of_pixel = {}, weights = {};
  add_alike({g.mean, 0, kMissingWindow / 2}, x, y, centre, squared_bandwidth, [&](vfloat w, int qx, int qy) {
    const auto at = [=](const Planes& planes, int c) { return load(planes.row(c, qy) + qx); };
    if (h.relative_count) w *= at(*h.relative_count, 0);
    weights += w;
    m0 = fma(w, at(h.mean, 0) - at(g.mean, 0), m0);
    m1 = fma(w, at(h.mean, 1) - at(g.mean, 1), m1);
    m2 = fma(w, at(h.mean, 2) - at(g.mean, 2), m2);
    const vfloat v = at(variance_of_h, 0);
    variance = fma(w * w, v, variance);
    of_pixel = fma(w, v, of_pixel);
  });
  return {{m0 / weights, m1 / weights, m2 / weights}, variance / (weights * weights), of_pixel / weights};
}

/// The sum of the planes, border included.
Planes sum_of_planes(const Planes& p) {
  Planes sum(p.width(), p.height(), 1, p.border(), 0);
  parallel_for(p.height() + 2 * p.border(), 8, [&](int row) {
    const int y = row - p.border();
    for (int x = -p.border(); x < p.width() + p.border() + kLanes; ++x)
      sum.row(0, y)[x] = p.row(0, y)[x] + p.row(1, y)[x] + p.row(2, y)[x];
  });
  return sum;
}

}  // namespace

Planes missing_light(const Moments& g, const Moments& h, const std::vector<unsigned char>& valid, int border) {
  const int width = h.mean.width(), height = h.mean.height();
  Planes result(width, height, 3, border, 0);
  const Planes alike = tolerance(g, h, valid), variance_of_h = sum_of_planes(h.variance_of_mean);
  for_each_batch(width, height, [&](int x, int y, int n) {
    vfloat own = {};
    for (int c = 0; c < 3; ++c) own += load(g.variance_of_mean.row(c, y) + x);
    const Difference d = guided_difference(g, h, variance_of_h, x, y, own + load(alike.row(0, y) + x));
    const vfloat squares = d.mean[0] * d.mean[0] + d.mean[1] * d.mean[1] + d.mean[2] * d.mean[2];
    const vfloat known = min(own / max(kCredible * d.of_pixel, splat(1e-30f)), splat(1));
    const vfloat noise = max(kSignificant * known, splat(kMinSignificant)) * (own + d.variance);
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
