// SPDX-License-Identifier: Apache-2.0
// Residual feedback (estimators/feedback.h) as plain double-precision loops.
#pragma once

#include "estimators/reference_control_variates.h"

namespace covary::reference {

/// F^ + means over alike cells of 2 x 2 pixels of h - F^, with bandwidths kappa and 3 kappa.
inline RgbImage feedback(const RgbImage& estimate, const RgbImage& std_error, const RgbImage& h,
                         const RgbImage& variance_of_h, int width, int height, int window, double kappa) {
  struct Cell {
    Rgb guide{}, residual{};
    double count = 0, variance = 0;
  };
  struct Mean {
    double weights = 0, squares = 0;
    Rgb sum{};
  };
  const int columns = (width + 1) / 2, rows = (height + 1) / 2, radius = window / 4;
  std::vector<Cell> cells(columns * rows);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      Cell& cell = cells[y / 2 * columns + x / 2];
      cell.count += 1;
      for (int c = 0; c < 3; ++c) {
        cell.guide[c] += estimate[y * width + x][c];
        cell.residual[c] += h[y * width + x][c] - estimate[y * width + x][c];
        cell.variance += variance_of_h[y * width + x][c];
      }
    }
  for (Cell& cell : cells)
    for (double& v : cell.guide) v /= cell.count;
  RgbImage result = estimate;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const Rgb& f = estimate[y * width + x];
      const double variance = distance2(std_error[y * width + x], {0, 0, 0});
      Mean means[2];
      for (int v = std::max(0, y / 2 - radius); v <= std::min(rows - 1, y / 2 + radius); ++v)
        for (int u = std::max(0, x / 2 - radius); u <= std::min(columns - 1, x / 2 + radius); ++u) {
          const Cell& cell = cells[v * columns + u];
          for (int i : {0, 1}) {
            const double bandwidth = (i == 0 ? 1 : 3) * kappa;
            const double w = std::exp(-distance2(cell.guide, f) / (bandwidth * bandwidth * variance));
            means[i].weights += w * cell.count;
            means[i].squares += w * w * cell.variance;
            for (int c = 0; c < 3; ++c) means[i].sum[c] += w * cell.residual[c];
          }
        }
      const double noise = means[0].squares / (means[0].weights * means[0].weights);
      const double share = 0.3 * variance / (0.3 * variance + noise);
      for (int c = 0; c < 3; ++c)
        result[y * width + x][c] +=
            share * means[0].sum[c] / means[0].weights + (1 - share) * means[1].sum[c] / means[1].weights;
    }
  return result;
}

}  // namespace covary::reference
