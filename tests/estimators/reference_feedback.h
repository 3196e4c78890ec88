// SPDX-License-Identifier: Apache-2.0
// Residual feedback (estimators/feedback.h) as plain double-precision loops.
#pragma once

#include "estimators/reference_control_variates.h"

namespace covary::reference {

/// Weighted mean of h - F^ over cells of side x side pixels that are like F^ at (x, y), and its variance.
struct GuidedMean {
  Rgb value{};
  double variance = 0;
};
inline GuidedMean guided_mean(const RgbImage& estimate, const RgbImage& h, const RgbImage& variance_of_h, int width,
                              int height, int x, int y, int side, int radius, double squared_bandwidth) {
  double weights = 0, squares = 0;
  Rgb sum{};
  for (int v = std::max(0, y / side - radius); v <= std::min((height - 1) / side, y / side + radius); ++v)
    for (int u = std::max(0, x / side - radius); u <= std::min((width - 1) / side, x / side + radius); ++u) {
      Rgb guide{}, residual{};
      double count = 0, variance = 0;
      for (int py = v * side; py < std::min(height, (v + 1) * side); ++py)
        for (int px = u * side; px < std::min(width, (u + 1) * side); ++px) {
          const size_t p = static_cast<size_t>(py) * width + px;
          count += 1;
          for (int c = 0; c < 3; ++c) {
            guide[c] += estimate[p][c];
            residual[c] += h[p][c] - estimate[p][c];
            variance += variance_of_h[p][c];
          }
        }
      for (double& g : guide) g /= count;
      const double w = std::exp(-distance2(guide, estimate[static_cast<size_t>(y) * width + x]) / squared_bandwidth);
      weights += w * count;
      squares += w * w * variance;
      for (int c = 0; c < 3; ++c) sum[c] += w * residual[c];
    }
  return {{sum[0] / weights, sum[1] / weights, sum[2] / weights}, squares / (weights * weights)};
}

/// F^ + means of h - F^ with bandwidths kappa and 4 kappa.
inline RgbImage feedback(const RgbImage& estimate, const RgbImage& std_error, const RgbImage& h,
                         const RgbImage& variance_of_h, int width, int height, int window, double kappa) {
  RgbImage result = estimate;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const size_t p = static_cast<size_t>(y) * width + x;
      const double variance = distance2(std_error[p], {0, 0, 0}), bandwidth = kappa * kappa * variance;
      const GuidedMean narrow = guided_mean(estimate, h, variance_of_h, width, height, x, y, 1, window / 4, bandwidth);
      const GuidedMean wide =
          guided_mean(estimate, h, variance_of_h, width, height, x, y, 2, window / 4, 16 * bandwidth);
      const double share = 0.3 * variance / (0.3 * variance + narrow.variance);
      for (int c = 0; c < 3; ++c) result[p][c] += share * narrow.value[c] + (1 - share) * wide.value[c];
    }
  return result;
}

}  // namespace covary::reference
