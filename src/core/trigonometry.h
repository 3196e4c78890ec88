// SPDX-License-Identifier: Apache-2.0
// Inlined sine and cosine of one angle, and the angle of a point: nearly all that sampling needs. Errors below 1e-7.
#pragma once

#include <algorithm>
#include <cmath>

namespace covary {

struct SinCos {
  float sin, cos;
};

/// For x in [-pi/4, pi/4], by Taylor series; the first omitted terms are below 3e-8.
inline SinCos sincos_octant(float x) {
  const float x2 = x * x;
  return {x * (1 + x2 * (-1.0f / 6 + x2 * (1.0f / 120 + x2 * (-1.0f / 5040 + x2 * (1.0f / 362880))))),
          1 + x2 * (-0.5f + x2 * (1.0f / 24 + x2 * (-1.0f / 720 + x2 * (1.0f / 40320))))};
}

/// Sine and cosine of the angle 2 pi `turns`, for any `turns` of moderate size.
inline SinCos sincos_turns(float turns) {
  const float quarters = std::nearbyint(4 * turns);
  const SinCos rest = sincos_octant((turns - 0.25f * quarters) * 6.28318530717958647692f);
  const int quadrant = static_cast<int>(quarters) & 3;
  const float s = quadrant & 1 ? rest.cos : rest.sin, c = quadrant & 1 ? rest.sin : rest.cos;
  return {quadrant & 2 ? -s : s, (quadrant == 1 || quadrant == 2) ? -c : c};
}

/// Angle of the point (x, y) from the x axis, in turns: in [0, 1], increasing towards the y axis; 0 for the origin.
inline float angle_turns(float y, float x) {
  const float ax = std::abs(x), ay = std::abs(y), larger = std::max(ax, ay);
  const float t = larger > 0 ? std::min(ax, ay) / larger : 0, t2 = t * t;
  // atan(t) / t on [0, 1]: minimax polynomial in t^2 (relative error 1.5e-8), exact at 0.
  float p = 2.97454997e-3f;
  for (const float c :
       {-0.0165810324f, 0.0435533113f, -0.0758056059f, 0.10678933f, -0.142142076f, 0.199941371f, -0.33333167f, 1.0f})
    p = c + p * t2;
  float turns = t * p * 0.15915494309189533577f;
  turns = ay > ax ? 0.25f - turns : turns;
  turns = x < 0 ? 0.5f - turns : turns;
  return y < 0 ? 1 - turns : turns;
}

}  // namespace covary
