// SPDX-License-Identifier: Apache-2.0
// Input of the image-space estimators: plain arrays, from any renderer.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "film/film.h"

namespace covary {

/// An image's values in the memory of a device.
struct ValuesOnDevice {
  const float* of = nullptr;  ///< `data` of the image; images with other values have none there
  uint64_t handle = 0;        ///< as Device::borrow() takes it (device/device.h)
  std::string device;         ///< DeviceInfo::id(), "cuda:0"
  /// How far apart groups, rows, pixels and channels lie, in floats; empty: in the order of GroupedImage::data. The
  /// handle is then an address of CUDA.
  std::vector<int64_t> strides;
};

/// T group means for every pixel of a linear RGB image: data[((y * width + x) * groups + t) * 3 + channel], each of
/// independent samples. Does not own the memory.
///
/// Without `counts`, all groups of all pixels have the same number of samples. With them, pixels may differ, and a
/// pixel's groups have the sizes of film/groups.h, which differ by at most one. Estimators then weight a pixel's groups
/// by their sizes; equal sizes give the same bits as no counts. Each estimator documents what it does with counts that
/// differ between pixels. For all of them, counts must not depend on the values of the same samples, or results are
/// biased.
struct GroupedImage {
  int width = 0, height = 0, groups = 0;
  const float* data = nullptr;
  const uint32_t* counts = nullptr;  ///< samples of each pixel, row by row; or null
  double mean_count = 0;             ///< of the whole image if this is a part of it; 0: of this image
  /// Mean squared deviation of a pixel's samples from the means of their groups, RGB, if the film keeps it; or null.
  /// Only read together with `counts`.
  const float* variance_in_groups = nullptr;
  /// Where that device need not be sent them; or null. Rows beside the first ones are sent.
  const ValuesOnDevice* on_device = nullptr;
  const float* pixel(int x, int y) const { return data + (static_cast<size_t>(y) * width + x) * groups * 3; }
  /// Samples of a pixel; without counts, one per group.
  uint32_t count(int x, int y) const {
    return counts ? counts[static_cast<size_t>(y) * width + x] : static_cast<uint32_t>(groups);
  }
  /// Estimated variance of one sample (film/groups.h), or of one group mean if no counts are known. Zero if there are
  /// fewer than two samples or groups to estimate it from.
  Spectrum sample_variance(int x, int y) const;
  bool has_equal_groups(int x, int y) const { return count(x, y) % static_cast<uint32_t>(groups) == 0; }
};

/// View of rows first_row … first_row + n_rows - 1 of an image.
GroupedImage rows_of(const GroupedImage& image, int first_row, int n_rows);
/// Group means and counts of the same rows of a film.
GroupedImage rows_of(const Film& film, int first_row, int n_rows);
/// Copy of the same rows of an image.
Image rows_of(const Image& image, int first_row, int n_rows);

/// Throws Error(kUsage) listing `problems`, if any. `name`: name of the estimator.
void throw_if_any(const std::string& name, const std::vector<std::string>& problems);

/// Appends to `problems` what is wrong with the pair (sizes, missing data, fewer than `min_crn_groups` groups, pixels
/// with fewer samples than groups …).
void check_inputs(const GroupedImage& crn, const GroupedImage& independent, int min_crn_groups,
                  int min_independent_groups, std::vector<std::string>& problems);

}  // namespace covary
