// SPDX-License-Identifier: Apache-2.0
// Input of the image-space estimators: plain arrays, from any renderer.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "film/film.h"

namespace covary {

/// T group means of every pixel of a linear RGB image: data[((y * width + x) * groups + t) * 3 + channel], each of
/// independent samples. Does not own the memory.
///
/// Without `counts`, all groups of all pixels hold the same number of samples. With them, pixels differ, and a pixel's
/// groups have the sizes of film/groups.h, which differ by one at most. Estimators then weight a pixel's groups by
/// their sizes; with equal sizes they give the same bits as without counts. What they do where pixels differ, each
/// says. For all of them, counts must not follow from the values of the same samples, or results are biased.
struct GroupedImage {
  int width = 0, height = 0, groups = 0;
  const float* data = nullptr;
  const uint32_t* counts = nullptr;  ///< samples of each pixel, row by row; or null
  double mean_count = 0;             ///< of the whole image where this is a part of it; 0: of this
  /// Mean squared deviation of a pixel's samples from the means of their groups, RGB, as films may keep it; or null.
  /// It is only read together with `counts`.
  const float* variance_in_groups = nullptr;
  const float* pixel(int x, int y) const { return data + (static_cast<size_t>(y) * width + x) * groups * 3; }
  /// Samples of a pixel; without counts, one in each group.
  uint32_t count(int x, int y) const {
    return counts ? counts[static_cast<size_t>(y) * width + x] : static_cast<uint32_t>(groups);
  }
  /// Estimated variance of one sample (film/groups.h); of a group where no counts are known. Zero where less
  /// than two samples or groups tell.
  Spectrum sample_variance(int x, int y) const;
  bool has_equal_groups(int x, int y) const { return count(x, y) % static_cast<uint32_t>(groups) == 0; }
};

/// Rows first_row … first_row + n_rows - 1 of an image, of its memory.
GroupedImage rows_of(const GroupedImage& image, int first_row, int n_rows);
/// Group means and counts of some rows of a film.
GroupedImage rows_of(const Film& film, int first_row, int n_rows);
/// A copy of some rows of an image.
Image rows_of(const Image& image, int first_row, int n_rows);

/// Throws Error(kUsage) that lists `problems` unless there are none. `name`: of the estimator.
void throw_if_any(const std::string& name, const std::vector<std::string>& problems);

/// Appends to `problems` what is wrong with the pair (sizes, missing data, fewer than `min_crn_groups` groups, pixels
/// with fewer samples than groups …).
void check_inputs(const GroupedImage& crn, const GroupedImage& independent, int min_crn_groups,
                  int min_independent_groups, std::vector<std::string>& problems);

}  // namespace covary
