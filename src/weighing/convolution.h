// SPDX-License-Identifier: Apache-2.0
// Convolutional layers over planes, each value a sum of products in a fixed order: the bits depend neither on the
// number of threads nor on the width of the lanes.
#pragma once

#include <array>
#include <string_view>
#include <vector>

#include "filters/planes.h"

namespace covary {

/// A layer's weights. `side`: of the square of pixels that a value depends on, 1 or 3.
struct Convolution {
  int side = 1, inputs = 0, outputs = 0;
  std::vector<float> weights;  ///< [input][row][column][output], outputs rounded up to kOutputsAtOnce
  std::vector<float> offsets;  ///< [output], likewise
};
inline constexpr int kOutputsAtOnce = 4;

/// Reads [row][column][input][output] and [output] of 16-bit floats from the beginning of `bytes`, and removes them.
/// Throws Error(kInternal) if there are too few.
Convolution read_convolution(std::string_view& bytes, int side, int inputs, int outputs);

/// The layer's values, with a border of one pixel of zeros. `sources`: whose planes are the inputs, with such borders;
/// the second may be null. `is_positive`: negative values become zero.
Planes convolved(const Convolution& layer, std::array<const Planes*, 2> sources, bool is_positive = true);

/// Means over 2 x 2 pixels, and the opposite: every pixel four times. With borders of zeros; `planes` has even sizes.
Planes halved(const Planes& planes);
Planes doubled(const Planes& planes);

/// A 16-bit float as 32 bits.
float from_half(uint16_t half);

}  // namespace covary
