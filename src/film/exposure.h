// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "film/film.h"

namespace covary {

/// Stops (powers of two) by which a picture should be exposed before it is shown in 8 bits: 0 unless more than a tenth
/// of the pixels that light reaches would be burnt (luminance above 1) or black (below 0.0015, five steps of 8-bit
/// sRGB). Otherwise the first half stop below 0 that leaves at most a tenth; without one, that which leaves the fewest
/// of them, nearest to 0 or, in dark pictures, to the one that maps the log-average luminance to 0.18 [Reinhard2002]
/// Eq. (1). The median of the lit pixels is never taken below 0.09: lamps and windows may be burnt. `linear`: RGB;
/// values that are not finite count as black.
double exposure_for_display(const Image& linear);

/// The image times 2^stops.
Image exposed(Image image, double stops);

}  // namespace covary
