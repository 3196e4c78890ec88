// SPDX-License-Identifier: Apache-2.0
// Sine and cosine together, inlined: the maps of sampling need little else. Errors below 1e-7.
#pragma once

#include <cmath>

namespace covary {

struct SinCos {
  float sin, cos;
};

/// For x in [-pi/4, pi/4], by Taylor series; the first terms left out are below 3e-8.
inline SinCos sincos_octant(float x) {
  const float x2 = x * x;
  return {x * (1 + x2 * (-1.0f / 6 + x2 * (1.0f / 120 + x2 * (-1.0f / 5040 + x2 * (1.0f / 362880))))),
          1 + x2 * (-0.5f + x2 * (1.0f / 24 + x2 * (-1.0f / 720 + x2 * (1.0f / 40320))))};
}

/// Of the angle 2 pi `turns`, any finite number of moderate size.
inline SinCos sincos_turns(float turns) {
  const float quarters = std::nearbyint(4 * turns);
  const SinCos rest = sincos_octant((turns - 0.25f * quarters) * 6.28318530717958647692f);
  const int quadrant = static_cast<int>(quarters) & 3;
  const float s = quadrant & 1 ? rest.cos : rest.sin, c = quadrant & 1 ? rest.sin : rest.cos;
  return {quadrant & 2 ? -s : s, (quadrant == 1 || quadrant == 2) ? -c : c};
}

}  // namespace covary
