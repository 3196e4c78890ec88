// SPDX-License-Identifier: Apache-2.0
// Sums of per-pixel contributions over square cells, with the means of a guide image; and sums over similar pixels:
// over cells of 4 x 4 pixels, in a window of 15 x 15 cells, with weights
//     w_ij = exp(-||G_j - G_i||^2 / ((0.5 G'_i)^2 + 1e-4)),   G: guide, G'_i: mean of its channels at the target.
#pragma once

#include <algorithm>

#include "core/parallel.h"
#include "filters/planes.h"

namespace covary {

/// `count` sums over the valid pixels of each cell of side x side pixels: planes 0 to 2 are the means of the guide,
/// kFar in cells without valid pixels and in the border; the sums are in planes 3 and up. A row of cells is one row;
/// column x holds the cell that contains pixel x. `border`: in columns, and in rows of cells. `add(x, y, sums)` adds
/// the contribution of a valid pixel to the sums of its cell; called from any thread.
template <typename Add>
Planes sums_by_cell(int side, int border, const Image& guide, const std::vector<unsigned char>& valid, int count,
                    const Add& add) {
  const int width = guide.width, height = guide.height, rows = (height + side - 1) / side;
  Planes cells(width, rows, 3 + count, border, 0.0f);
  for (int c = 0; c < 3; ++c)
    for (int row = -border; row < rows + border; ++row) std::fill_n(cells.row(c, row) - border, cells.stride(), kFar);
  parallel_for(rows, [&](int row) {
    std::vector<float> sums(static_cast<size_t>(count));
    for (int x0 = 0; x0 < width; x0 += side) {
      std::fill(sums.begin(), sums.end(), 0.0f);
      float mean[3] = {}, n = 0;
      for (int y = side * row; y < std::min(height, side * (row + 1)); ++y)
        for (int x = x0; x < std::min(width, x0 + side); ++x) {
          if (!valid[static_cast<size_t>(y) * width + x]) continue;
          for (int c = 0; c < 3; ++c) mean[c] += guide.pixel(x, y)[c];
          n += 1;
          add(x, y, sums.data());
        }
      if (n == 0) continue;
      // Beyond the last column as well: neighbouring cells are read at multiples of `side` from any column of a cell.
      for (int x = x0; x < x0 + side; ++x) {
        for (int c = 0; c < 3; ++c) cells.row(c, row)[x] = mean[c] / n;
        for (int i = 0; i < count; ++i) cells.row(3 + i, row)[x] = sums[static_cast<size_t>(i)];
      }
    }
  });
  return cells;
}

class GuidedCells {
 public:
  /// `count`, `add`: as for sums_by_cell().
  template <typename Add>
  GuidedCells(const Image& guide, const std::vector<unsigned char>& valid, int count, const Add& add)
      : guide_(guide), count_(count), cells_(sums_by_cell(kCell, kHalo, guide, valid, count, add)) {}

  /// The guided sums at the pixels (x + lane, y).
  void sum(int x, int y, lanes::vfloat* sums) const;

 private:
  static constexpr int kCell = 4, kRadius = 7;  // side of a cell in pixels; radius of the window in cells
  static constexpr int kHalo = kCell * kRadius;
  const Image& guide_;
  int count_;
  Planes cells_;
};

}  // namespace covary
