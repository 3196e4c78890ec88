// SPDX-License-Identifier: Apache-2.0
// Residual correction (filters/residual_correction.h) as plain double-precision loops.
#pragma once

#include "estimators/reference_control_variates.h"

namespace covary::reference {

/// Weighted mean of h - F^ over cells of side x side pixels whose F^ is similar to that at (x, y), and its variance.
struct GuidedMean {
  Rgb value{};
  double variance = 0;
};
inline GuidedMean guided_mean(const RgbImage& estimate, const RgbImage& h, const RgbImage& variance_of_h, int width,
                              int height, int x, int y, int side, int radius, double squared_bandwidth,
                              const GroupedImage& counted) {
  double weights = 0, squares = 0;
  Rgb sum{};
  for (int v = std::max(0, y / side - radius); v <= std::min((height - 1) / side, y / side + radius); ++v)
    for (int u = std::max(0, x / side - radius); u <= std::min((width - 1) / side, x / side + radius); ++u) {
      Rgb guide{}, residual{};
      double count = 0, weight = 0, variance = 0;
      for (int py = v * side; py < std::min(height, (v + 1) * side); ++py)
        for (int px = u * side; px < std::min(width, (u + 1) * side); ++px) {
          const size_t p = static_cast<size_t>(py) * width + px;
          const double n = counted.counts ? counted.count(px, py) : 1;
          count += 1;
          weight += n;
          for (int c = 0; c < 3; ++c) {
            guide[c] += estimate[p][c];
            residual[c] += n * (h[p][c] - estimate[p][c]);
            variance += n * n * variance_of_h[p][c];
          }
        }
      for (double& g : guide) g /= count;
      const double w = std::exp(-distance2(guide, estimate[static_cast<size_t>(y) * width + x]) / squared_bandwidth);
      weights += w * weight;
      squares += w * w * variance;
      for (int c = 0; c < 3; ++c) sum[c] += w * residual[c];
    }
  return {{sum[0] / weights, sum[1] / weights, sum[2] / weights}, squares / (weights * weights)};
}

/// Two steps of F^ + means of h - F^: with bandwidths kappa and 4 kappa, then with 12 kappa; weighted by the sample
/// counts of h's image, if it has any.
inline RgbImage residual_correction(const RgbImage& estimate, const RgbImage& std_error, const RgbImage& h,
                                    const RgbImage& variance_of_h, int width, int height, int window, double kappa,
                                    const GroupedImage& counted = {}) {
  RgbImage first = estimate;
  const auto mean = [&](const RgbImage& f, int x, int y, int side, int radius, double bandwidth) {
    const double variance = distance2(std_error[static_cast<size_t>(y) * width + x], {0, 0, 0});
    return guided_mean(f, h, variance_of_h, width, height, x, y, side, radius, bandwidth * bandwidth * variance,
                       counted);
  };
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const size_t p = static_cast<size_t>(y) * width + x;
      const double variance = distance2(std_error[p], {0, 0, 0});
      const GuidedMean narrow = mean(estimate, x, y, 1, window / 4, kappa);
      const GuidedMean wide = mean(estimate, x, y, 2, window / 4, 4 * kappa);
      const double a = 0.2 * variance / (0.2 * variance + narrow.variance);
      const double b = variance / (variance + wide.variance);
      for (int c = 0; c < 3; ++c) first[p][c] += a * narrow.value[c] + (1 - a) * b * wide.value[c];
    }
  RgbImage second = first;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const size_t p = static_cast<size_t>(y) * width + x;
      const double variance = distance2(std_error[p], {0, 0, 0});
      const GuidedMean again = mean(first, x, y, 4, window / 8, 12 * kappa);
      const double b = variance / (variance + again.variance);
      for (int c = 0; c < 3; ++c) second[p][c] += b * again.value[c];
    }
  return second;
}

}  // namespace covary::reference
