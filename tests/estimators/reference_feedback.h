// SPDX-License-Identifier: Apache-2.0
// Residual feedback (estimators/feedback.h) as plain double-precision loops.
#pragma once

#include "estimators/reference_control_variates.h"

namespace covary::reference {

/// F^ + mean over alike cells of 2 x 2 pixels of h - F^.
inline RgbImage feedback(const RgbImage& estimate, const RgbImage& std_error, const RgbImage& h, int width, int height,
                         int window, double kappa) {
  struct Cell {
    Rgb guide{}, residual{};
    double count = 0;
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
      }
    }
  for (Cell& cell : cells)
    for (double& v : cell.guide) v /= cell.count;
  RgbImage result = estimate;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const Rgb& f = estimate[y * width + x];
      const double bandwidth = kappa * kappa * distance2(std_error[y * width + x], {0, 0, 0});
      double weights = 0;
      Rgb sum{};
      for (int v = std::max(0, y / 2 - radius); v <= std::min(rows - 1, y / 2 + radius); ++v)
        for (int u = std::max(0, x / 2 - radius); u <= std::min(columns - 1, x / 2 + radius); ++u) {
          const Cell& cell = cells[v * columns + u];
          const double w = std::exp(-distance2(cell.guide, f) / bandwidth);
          weights += w * cell.count;
          for (int c = 0; c < 3; ++c) sum[c] += w * cell.residual[c];
        }
      for (int c = 0; c < 3; ++c) result[y * width + x][c] += sum[c] / weights;
    }
  return result;
}

}  // namespace covary::reference
