// SPDX-License-Identifier: Apache-2.0
// Planar images with a border, so that windows can be read with plain vector loads and without bounds checks.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <vector>

#include "core/parallel.h"
#include "film/grouped_image.h"
#include "filters/lanes.h"

namespace covary {

/// `count` images of width x height floats, each with `border` more pixels on every side (and room to read kLanes
/// floats from any valid column). The border keeps its initial value.
class Planes {
 public:
  Planes() = default;
  Planes(int width, int height, int count, int border, float value);

  int width() const { return width_; }
  int height() const { return height_; }
  int count() const { return count_; }
  int border() const { return border_; }
  ptrdiff_t stride() const { return stride_; }
  /// Address of column 0 of row y of plane c; y in [-border, height + border).
  float* row(int c, int y) { return data_.data() + offset(c, y); }
  const float* row(int c, int y) const { return data_.data() + offset(c, y); }

 private:
  size_t offset(int c, int y) const {
    return (static_cast<size_t>(c) * (height_ + 2 * border_) + (y + border_)) * stride_ + border_;
  }
  int width_ = 0, height_ = 0, count_ = 0, border_ = 0;
  ptrdiff_t stride_ = 0;
  std::vector<float> data_;
};

/// Calls batch(x, y, n) for all batches of pixels (x … x + n - 1, y), n <= kLanes, of an image, rows in parallel.
template <typename Batch>
void for_each_batch(int width, int height, const Batch& batch) {
  parallel_for(height, 4, [&](int y) {
    const lanes::FlushTiny flush;
    for (int x = 0; x < width; x += lanes::kLanes) batch(x, y, std::min(lanes::kLanes, width - x));
  });
}

/// Value of features outside the frame and at pixels with non-finite input: farther from every real pixel than any
/// bandwidth, but with a finite square.
inline constexpr float kFar = 1e18f;
/// Error variance of such pixels, which prevents a coefficient.
inline constexpr float kUseless = 1e30f;

/// Mean and variance of a grouped image as planes, weighted by group sizes.
struct Moments {
  Planes mean;              ///< 3 planes; `outside` beyond the frame and at invalid pixels
  Planes variance_of_mean;  ///< 3 planes: sample variance of the groups / T; kUseless outside; zero where T = 1
  /// 1 plane: samples of the pixel relative to the image's mean, 1 outside; null if all pixels have the same number.
  std::optional<Planes> relative_count;
};

/// Values from here on are left out like those that are not finite: the sums of their squares could exceed a float.
inline constexpr float kTooLarge = 0x1p50f;                                 // 1.1e15
inline bool is_usable(float value) { return std::abs(value) < kTooLarge; }  // false for NaN

/// 1 for pixels whose values are all usable in both images, otherwise 0.
std::vector<unsigned char> finite_pixels(const GroupedImage& a, const GroupedImage& b, long& n_nonfinite);

/// Moments of `image` from the groups first, first + step, first + 2 step, …
Moments moments(const GroupedImage& image, const std::vector<unsigned char>& valid, int border, float outside,
                int first = 0, int step = 1);

/// Sets every invalid pixel of `result` to the mean of the usable groups of both images, or else of the valid pixels of
/// `result` in the surrounding 5 x 5, or zero.
void fill_invalid(const GroupedImage& a, const GroupedImage& b, const std::vector<unsigned char>& valid, Image& result);

/// Offsets in the window x window square around a pixel, from the centre outwards: by squared distance, then row, then
/// column.
struct Offset {
  int dx, dy;
};
std::vector<Offset> window_offsets(int window);

}  // namespace covary
