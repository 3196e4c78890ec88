// SPDX-License-Identifier: Apache-2.0
// Sums over pixels that look like a target: of cells of 4 x 4 pixels, in a window of 15 x 15 cells,
//     w_ij = exp(-||G_j - G_i||^2 / ((0.5 G'_i)^2 + 1e-4)),   G: a guide, G'_i: mean of its channels at the target.
#pragma once

#include <algorithm>

#include "core/parallel.h"
#include "filters/planes.h"

namespace covary {

inline constexpr int kGuidedCell = 4;    ///< side of a cell, in pixels
inline constexpr int kGuidedRadius = 7;  ///< of the window, in cells

class GuidedCells {
 public:
  /// `add(x, y, sums)` adds what the valid pixel contributes to the `count` sums of its cell; called from any thread.
  template <typename Add>
  GuidedCells(const Image& guide, const std::vector<unsigned char>& valid, int count, const Add& add)
      : guide_(guide), count_(count) {
    const int width = guide.width, height = guide.height, rows = (height + kGuidedCell - 1) / kGuidedCell;
    cells_ = Planes(width, rows, 3 + count, kReach, 0.0f);
    for (int c = 0; c < 3; ++c)
      for (int row = -kReach; row < rows + kReach; ++row)
        std::fill_n(cells_.row(c, row) - kReach, cells_.stride(), kFar);
    parallel_for(rows, [&](int row) {
      std::vector<float> sums(static_cast<size_t>(count));
      for (int x0 = 0; x0 < width; x0 += kGuidedCell) {
        std::fill(sums.begin(), sums.end(), 0.0f);
        float mean[3] = {}, n = 0;
        for (int y = kGuidedCell * row; y < std::min(height, kGuidedCell * (row + 1)); ++y)
          for (int x = x0; x < std::min(width, x0 + kGuidedCell); ++x) {
            if (!valid[static_cast<size_t>(y) * width + x]) continue;
            for (int c = 0; c < 3; ++c) mean[c] += guide.pixel(x, y)[c];
            n += 1;
            add(x, y, sums.data());
          }
        if (n == 0) continue;
        // Every column of a cell holds the cell, those beyond the frame, too.
        for (int x = x0; x < x0 + kGuidedCell; ++x) {
          for (int c = 0; c < 3; ++c) cells_.row(c, row)[x] = mean[c] / n;
          for (int i = 0; i < count; ++i) cells_.row(3 + i, row)[x] = sums[static_cast<size_t>(i)];
        }
      }
    });
  }

  /// The guided sums at the pixels (x + lane, y).
  void sum(int x, int y, lanes::vfloat* sums) const;

 private:
  static constexpr int kReach = kGuidedCell * kGuidedRadius;
  const Image& guide_;
  int count_;
  Planes cells_;  // guide, then sums; cells in rows of cells
};

}  // namespace covary
