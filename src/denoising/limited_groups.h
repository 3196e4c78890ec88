// SPDX-License-Identifier: Apache-2.0
// Bright groups of samples that nothing else bears out: fireflies, which a denoiser would spread over its surroundings.
// A denoiser gets them only as bright as independent samples around say that the picture may be (ours).
//
// Claim: biased, towards dark; consistent, because groups of more samples differ less.
#pragma once

#include <cstdint>
#include <vector>

#include "film/grouped_image.h"

namespace covary {

/// Side of the window around a pixel whose groups say how bright its own may be, and how many times as bright as these
/// (measured: docs/notes/denoising.md).
inline constexpr int kLimitWindow = 7;
inline constexpr float kBrighter = 6;

/// A copy of an image in which each group is at most kBrighter times as bright (mean of its channels) as the brightest
/// one around it of the other half of the groups: groups 0, 2, 4, … are limited by 1, 3, 5, …, and these by those.
/// Brighter ones are scaled. Where half of the groups have no light around a pixel, the others have none there either.
/// An image of one group keeps its values. Pixels with 0 in `valid` are left out, and keep theirs.
class LimitedGroups {
 public:
  LimitedGroups(const GroupedImage& image, const std::vector<unsigned char>& valid);
  /// Valid while this object and the image's counts live.
  const GroupedImage& view() const { return view_; }
  LimitedGroups(const LimitedGroups&) = delete;
  LimitedGroups& operator=(const LimitedGroups&) = delete;

 private:
  GroupedImage view_;
  std::vector<float> data_;
};

}  // namespace covary
