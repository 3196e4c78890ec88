// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

namespace covary {

/// Memory order of texels: 4 x 4 blocks, row-major, texels within a block row-major. The four texels of a bilinear
/// lookup then lie in one or two cache lines and pages rather than in distant rows.
class BlockLayout {
 public:
  static constexpr int kBlock = 4;

  BlockLayout(int width, int height)
      : blocks_x_((width + kBlock - 1) / kBlock),
        blocks_y_((height + kBlock - 1) / kBlock),
        row_of_blocks_(static_cast<size_t>(blocks_x_) * kBlock * kBlock) {}

  int blocks_x() const { return blocks_x_; }
  int blocks_y() const { return blocks_y_; }
  /// Number of texels to allocate: the image's, and the padding that completes blocks at its right and bottom edges.
  size_t size() const { return blocks_y_ * row_of_blocks_; }

  size_t index(int x, int y) const { return row_offset(y) + column_offset(x); }
  // The two terms of the index. Unsigned arithmetic turns divisions into shifts.
  size_t row_offset(int y) const {
    const auto row = static_cast<size_t>(y);
    return row / kBlock * row_of_blocks_ + row % kBlock * kBlock;
  }
  static size_t column_offset(int x) {
    const auto column = static_cast<size_t>(x);
    return column / kBlock * (kBlock * kBlock) + column % kBlock;
  }

 private:
  int blocks_x_, blocks_y_;
  size_t row_of_blocks_;  // texels in it
};

}  // namespace covary
