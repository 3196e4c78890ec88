// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace covary {

/// The mean of the three channels of a pixel.
inline float grey(const float* rgb) { return (rgb[0] + rgb[1] + rgb[2]) * (1.0f / 3.0f); }

}  // namespace covary
