// SPDX-License-Identifier: Apache-2.0
// Values that no estimate can use: a single group of one pixel that outshines the whole picture. If light of
// such samples made up as much of the picture as everything else, n pixels of brightness m would hold n m T / v groups
// of T with the value v: less than one in kMaxOfPicture. Such values come from divisions by nearly 0; with one of
// them, held-out samples judge nothing else.
#pragma once

#include <vector>

#include "film/grouped_image.h"

namespace covary {

/// A value is stray if, times 1 / T for one of T groups, it outshines the picture so many times: the sum over pixels of
/// the brightness by all but the brightest group, black pixels counting as 0.1, as in relMSE.
inline constexpr double kMaxOfPicture = 1e4;

/// A picture with more stray values is like that.
inline constexpr size_t kMaxStrays = 64;

struct StrayValue {
  int x = 0, y = 0, group = 0;
  float brightness = 0;  ///< mean of its channels
};

/// Finds stray values in two groups or more. Light that another group of the pixel confirms is not one, nor is one of
/// many.
class StrayValues {
 public:
  /// The next rows. Values that are not usable (filters/planes.h) are ignored.
  void add_rows(const GroupedImage& image);
  /// Call after the last row; the brightest first.
  std::vector<StrayValue> found() const;

 private:
  int next_row_ = 0, groups_ = 1;
  double light_ = 0;                   ///< of the picture
  std::vector<StrayValue> brightest_;  ///< a heap with the darkest first
};

/// Sets these values of rows that begin at `first_row` to NaN; `data`: as GroupedImage::data, of n_rows rows.
void leave_out(const std::vector<StrayValue>& strays, int first_row, int n_rows, int width, int groups, float* data);

/// An image with 3 channels in which pixels with values that are not usable, or stray, become the mean of the
/// others around them, in the smallest square that has some; 0 if there are none. Without another group, a value
/// is stray if it outshines kMaxOfPicture times all but the brightest kMaxStrays pixels, and the eight pixels around,
/// too. `replaced`: these pixels; may be null.
Image with_usable_values(Image image, std::vector<StrayValue>* replaced = nullptr);

}  // namespace covary
