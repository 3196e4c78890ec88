// SPDX-License-Identifier: Apache-2.0
#include "estimators/feedback.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>

namespace covary {

using namespace lanes;

namespace {

constexpr int kGuide = 0, kResidual = 3, kCount = 6, kVariance = 7, kPlanes = 8;
constexpr int kCell = 2;
/// Variance of the narrow mean, relative to that of the estimate, at which both means count equally. 0.1 to 3 trade bias for
/// error, slowly (docs/methods/iicv.md).
constexpr float kNoise = 0.3f;
/// Bandwidth of the wide mean over that of the narrow one.
constexpr float kWidening = 3;

/// The weight with the narrow bandwidth for a weight with the wide one: its power of kWidening^2. Small weights are left
/// out before their powers lose precision.
vfloat to_narrow(vfloat wide_weight) {
  const vfloat w = wide_weight > splat(1e-4f) ? wide_weight : vfloat{};
  const vfloat w2 = w * w, w4 = w2 * w2;
  return w4 * w4 * w;
}

/// Cells of 2 x 2 pixels, one row of cells per row, repeated horizontally so that column x holds the cell of pixel x:
/// mean of F^ (kFar for cells without valid pixels), sums of h - F^ and of var h (over RGB), number of valid pixels.
Planes make_cells(const Moments& h, const std::vector<unsigned char>& valid, const Image& f, int border) {
  const int width = f.width, height = f.height, cell_rows = (height + kCell - 1) / kCell;
  Planes cells(width, cell_rows, kPlanes, border, 0.0f);
  for (int c = 0; c < 3; ++c)
    for (int row = -border; row < cell_rows + border; ++row)
      std::fill_n(cells.row(kGuide + c, row) - border, cells.stride(), kFar);
  tbb::parallel_for(0, cell_rows, [&](int row) {
    const int y0 = kCell * row, y1 = std::min(height, y0 + kCell);
    for (int x0 = 0; x0 < width; x0 += kCell) {
      float guide[3] = {}, residual[3] = {}, variance = 0, count = 0;
      for (int y = y0; y < y1; ++y)
        for (int x = x0; x < std::min(width, x0 + kCell); ++x) {
          if (!valid[static_cast<size_t>(y) * width + x]) continue;
          count += 1;
          for (int c = 0; c < 3; ++c) {
            guide[c] += f.pixel(x, y)[c];
            residual[c] += h.mean.row(c, y)[x] - f.pixel(x, y)[c];
            variance += h.variance_of_mean.row(c, y)[x];
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
        cells.row(kVariance, row)[x] = variance;
      }
    }
  });
  return cells;
}

/// Weighted sums of residuals.
struct Sums {
  vfloat weights = {}, residuals[3] = {};
  /// Where nothing is alike, there is nothing to give back.
  vfloat mean(int c) const { return residuals[c] / max(weights, splat(1e-20f)); }
};

}  // namespace

void add_feedback(const Moments& h, const FeedbackOptions& options, const std::vector<unsigned char>& valid,
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
        const float widest = options.bandwidth * kWidening;
        const vfloat inverse_bandwidth = -1.0f / max(variance * (widest * widest), splat(1e-30f));
        Sums wide, narrow;
        vfloat noise = {};
        for (int dy = -radius; dy <= radius; ++dy) {
          const float* p[kPlanes];
          for (int i = 0; i < kPlanes; ++i) p[i] = cells.row(i, row + dy) + x;
          for (int dx = -reach; dx <= reach; dx += kCell) {
            const vfloat d0 = load(p[kGuide] + dx) - f[0], d1 = load(p[kGuide + 1] + dx) - f[1],
                         d2 = load(p[kGuide + 2] + dx) - f[2];
            const vfloat w = exp_of_nonpositive((d0 * d0 + d1 * d1 + d2 * d2) * inverse_bandwidth), n = to_narrow(w);
            const vfloat count = load(p[kCount] + dx);
            wide.weights += w * count;
            narrow.weights += n * count;
            noise += n * n * load(p[kVariance] + dx);
            for (int c = 0; c < 3; ++c) {
              const vfloat residual = load(p[kResidual + c] + dx);
              wide.residuals[c] += w * residual;
              narrow.residuals[c] += n * residual;
            }
          }
        }
        // Without weights, or beyond the range of floats, the wide mean alone.
        const vfloat tolerated = kNoise * variance * narrow.weights * narrow.weights;
        const vfloat excess = (noise + splat(1e-30f)) / max(tolerated, splat(1e-37f));
        const vfloat share = excess >= 0.0f ? 1 / (1 + excess) : vfloat{};
        for (int c = 0; c < 3; ++c) {
          const vfloat feedback = share * narrow.mean(c) + (1 - share) * wide.mean(c);
          for (int l = 0; l < std::min(kLanes, width - x); ++l)
            if (valid[static_cast<size_t>(y) * width + x + l]) estimate.pixel(x + l, y)[c] += feedback[l];
        }
      }
    }
  });
}

}  // namespace covary
