// SPDX-License-Identifier: Apache-2.0
// Every second group of an image: half of its samples, independent of the other half, so that one can judge what was
// made from the other.
#pragma once

#include <cstdint>
#include <vector>

#include "film/grouped_image.h"

namespace covary {

/// A copy of the groups first, first + 2, … of an image.
class HalfImage {
 public:
  /// `first`: 0 or 1; `image` has two groups or more.
  HalfImage(const GroupedImage& image, int first);
  /// Valid as long as this object lives.
  GroupedImage view() const;

 private:
  GroupedImage shape_;
  std::vector<float> data_;
  std::vector<uint32_t> counts_;  // empty if the image has none
};

}  // namespace covary
