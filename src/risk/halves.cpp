// SPDX-License-Identifier: Apache-2.0
#include "risk/halves.h"

#include <algorithm>

#include "core/error.h"
#include "core/parallel.h"
#include "film/groups.h"

namespace covary {

HalfImage::HalfImage(const GroupedImage& image, int first)
    : shape_{image.width, image.height, (image.groups - first + 1) / 2} {
  COVARY_CHECK(first >= 0 && first <= 1 && image.groups >= 2, "every second of two or more groups");
  const size_t n_pixels = static_cast<size_t>(image.width) * image.height;
  data_.resize(n_pixels * shape_.groups * 3);
  if (image.counts) counts_.resize(n_pixels);
  parallel_for(image.height, 16, [&](int y) {
    for (int x = 0; x < image.width; ++x) {
      const size_t pixel = static_cast<size_t>(y) * image.width + x;
      float* to = data_.data() + pixel * shape_.groups * 3;
      for (int t = first; t < image.groups; t += 2, to += 3) std::copy_n(image.pixel(x, y) + 3 * t, 3, to);
      // The larger groups come first (film/groups.h), here as there.
      for (int t = first; image.counts && t < image.groups; t += 2)
        counts_[pixel] += group_size(image.count(x, y), image.groups, t);
    }
  });
}

GroupedImage HalfImage::view() const {
  GroupedImage view = shape_;
  view.data = data_.data();
  if (!counts_.empty()) view.counts = counts_.data();
  return view;
}

}  // namespace covary
