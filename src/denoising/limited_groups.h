// SPDX-License-Identifier: Apache-2.0
// Clamps fireflies, bright groups of samples that no other group confirms, before a denoiser spreads them: the
// brightness of independent samples around it limits a group. [DeCoro2010] rejects samples that no
// neighbour confirms, [Jeffery2020] fireflies that only one half buffer has.
//
// Claim: biased towards dark; consistent, because groups of more samples differ less.
#pragma once

#include <cstdint>
#include <vector>

#include "film/grouped_image.h"

namespace covary {

/// Side of the window, in pixels, whose groups limit those of the pixel in its middle, and the limit as a multiple of
/// their brightness (measured: docs/notes/denoising.md).
inline constexpr int kLimitWindow = 7;
inline constexpr float kBrighter = 6;

/// A copy of an image in which each group is at most kBrighter times as bright (mean of its channels) as the brightest
/// group of the other half in the window: groups 0, 2, 4, … are limited by 1, 3, 5, …, and vice versa. Brighter groups
/// are scaled down. Where one half is black in the window, the other becomes black at the pixel. An image of one group
/// keeps its values. Pixels with 0 in `valid` are left out and keep theirs.
class LimitedGroups {
 public:
  LimitedGroups(const GroupedImage& image, const std::vector<unsigned char>& valid);
  /// Valid while this object and the image's counts exist.
  const GroupedImage& view() const { return view_; }
  LimitedGroups(const LimitedGroups&) = delete;
  LimitedGroups& operator=(const LimitedGroups&) = delete;

 private:
  GroupedImage view_;
  std::vector<float> data_;
};

}  // namespace covary
