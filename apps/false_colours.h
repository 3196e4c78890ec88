// SPDX-License-Identifier: Apache-2.0
// Brightness as colours, with a scale: for images that nobody looks at as pictures, such as standard errors.
#pragma once

#include "film/film.h"

namespace covary {

/// The mean of the channels as a colour, from dark blue over red and orange to pale yellow, by its logarithm between
/// the largest value but one in a thousand and a thousandth of that; below, a strip with the scale and its powers of
/// ten. Linear, so that a file of 8 bits in sRGB shows the colours. Values that are not positive are black.
Image in_false_colours(const Image& image);

}  // namespace covary
