// SPDX-License-Identifier: Apache-2.0
// Transfer functions of sRGB (IEC 61966-2-1).
#pragma once

#include <cmath>

namespace covary {

/// Encoded value in [0, 1] to linear.
inline float srgb_to_linear(float encoded) {
  return encoded <= 0.04045f ? encoded / 12.92f : std::pow((encoded + 0.055f) / 1.055f, 2.4f);
}
/// Linear value in [0, 1] to encoded.
inline float linear_to_srgb(float linear) {
  return linear <= 0.0031308f ? linear * 12.92f : 1.055f * std::pow(linear, 1 / 2.4f) - 0.055f;
}

}  // namespace covary
