// SPDX-License-Identifier: Apache-2.0
// Input and output of the image-space estimators: plain arrays, from any renderer.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "film/film.h"

namespace covary {

/// T group means of every pixel of a linear RGB image: data[((y * width + x) * groups + t) * 3 + channel]. All groups
/// of the image hold the same number of independent samples. Does not own the memory.
struct GroupedImage {
  int width = 0, height = 0, groups = 0;
  const float* data = nullptr;
  const float* pixel(int x, int y) const { return data + (static_cast<size_t>(y) * width + x) * groups * 3; }
};

/// What an estimator returns. `estimate` has the three channels R, G, B. `std_error` has them too, or is empty where no
/// error estimate was asked for.
struct EstimatorResult {
  Image estimate;
  Image std_error;
  /// Pixels with a non-finite value in either input. They are left out everywhere else and show the mean of their
  /// finite groups, or zero where there are none.
  long nonfinite_pixels = 0;
};

/// Throws Error(kUsage) that lists `problems` unless there are none. `name`: of the estimator.
void throw_if_any(const std::string& name, const std::vector<std::string>& problems);

/// Appends to `problems` what is wrong with the pair (sizes, missing data, fewer than `min_crn_groups` groups …).
void check_inputs(const GroupedImage& crn, const GroupedImage& independent, int min_crn_groups,
                  int min_independent_groups, std::vector<std::string>& problems);

}  // namespace covary
