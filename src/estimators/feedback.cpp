// SPDX-License-Identifier: Apache-2.0
#include "estimators/feedback.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>

namespace covary {

using namespace lanes;

namespace {

constexpr int kGuide = 0, kResidual = 3, kCount = 6, kPlanes = 7;
constexpr int kCell = 2;

/// Cells of 2 x 2 pixels, one row of cells per row, repeated horizontally so that column x holds the cell of pixel x:
/// mean of F^ (kFar for cells without valid pixels), sum of h - F^, number of valid pixels.
Planes make_cells(const Planes& h, const std::vector<unsigned char>& valid, const Image& f, int border) {
  const int width = f.width, height = f.height, cell_rows = (height + kCell - 1) / kCell;
  Planes cells(width, cell_rows, kPlanes, border, 0.0f);
  for (int c = 0; c < 3; ++c)
    for (int row = -border; row < cell_rows + border; ++row)
      std::fill_n(cells.row(kGuide + c, row) - border, cells.stride(), kFar);
  tbb::parallel_for(0, cell_rows, [&](int row) {
    const int y0 = kCell * row, y1 = std::min(height, y0 + kCell);
    for (int x0 = 0; x0 < width; x0 += kCell) {
      float guide[3] = {}, residual[3] = {}, count = 0;
      for (int y = y0; y < y1; ++y)
        for (int x = x0; x < std::min(width, x0 + kCell); ++x) {
          if (!valid[static_cast<size_t>(y) * width + x]) continue;
          count += 1;
          for (int c = 0; c < 3; ++c) {
            guide[c] += f.pixel(x, y)[c];
            residual[c] += h.row(c, y)[x] - f.pixel(x, y)[c];
          }
        }
      if (count == 0) continue;
      // Beyond the last column, too: from odd columns, a cell is read at its odd column.
      for (int x = x0; x < x0 + kCell; ++x) {
        for (int c = 0; c < 3; ++c) {
          cells.row(kGuide + c, row)[x] = guide[c] / count;
          cells.row(kResidual + c, row)[x] = residual[c];
        }
        cells.row(kCount, row)[x] = count;
      }
    }
  });
  return cells;
}

}  // namespace

void add_feedback(const Planes& h, const FeedbackOptions& options, const std::vector<unsigned char>& valid,
                  const Image& std_error, Image& estimate) {
  const int width = estimate.width, height = estimate.height;
  // The window's radius in cells, and in pixels for the columns, which are repeated.
  const int radius = options.window / 2 / kCell, reach = radius * kCell;
  const Planes cells = make_cells(h, valid, estimate, reach);
  tbb::parallel_for(tbb::blocked_range<int>(0, height, 4), [&](const tbb::blocked_range<int>& rows) {
    for (int y = rows.begin(); y < rows.end(); ++y) {
      const int row = y / kCell;
      for (int x = 0; x < width; x += kLanes) {
        vfloat f[3], variance = {};
        for (int c = 0; c < 3; ++c) {
          vfloat error;
          for (int l = 0; l < kLanes; ++l) {
            f[c][l] = estimate.pixel(std::min(x + l, width - 1), y)[c];
            error[l] = std_error.pixel(std::min(x + l, width - 1), y)[c];
          }
          variance += error * error;
        }
        const vfloat inverse_bandwidth = -1.0f / max(variance * (options.bandwidth * options.bandwidth), splat(1e-30f));
        vfloat weights = {}, sum[3] = {};
        for (int dy = -radius; dy <= radius; ++dy) {
          const float* p[kPlanes];
          for (int i = 0; i < kPlanes; ++i) p[i] = cells.row(i, row + dy) + x;
          for (int dx = -reach; dx <= reach; dx += kCell) {
            const vfloat d0 = load(p[kGuide] + dx) - f[0], d1 = load(p[kGuide + 1] + dx) - f[1],
                         d2 = load(p[kGuide + 2] + dx) - f[2];
            const vfloat w = exp_of_nonpositive((d0 * d0 + d1 * d1 + d2 * d2) * inverse_bandwidth);
            weights += w * load(p[kCount] + dx);
            for (int c = 0; c < 3; ++c) sum[c] += w * load(p[kResidual + c] + dx);
          }
        }
        // Where nothing is alike, there is nothing to give back.
        const vfloat inverse = 1.0f / max(weights, splat(1e-20f));
        for (int l = 0; l < std::min(kLanes, width - x); ++l)
          if (valid[static_cast<size_t>(y) * width + x + l])
            for (int c = 0; c < 3; ++c) estimate.pixel(x + l, y)[c] += sum[c][l] * inverse[l];
      }
    }
  });
}

}  // namespace covary
