// SPDX-License-Identifier: Apache-2.0
// Low-discrepancy points in the unit cube, for quadrature over lights.
#pragma once

#include <cmath>

#include "core/vec.h"

namespace covary {

/// Point i of the plastic-number lattice in three dimensions (Roberts 2018), in [0, 1)^3.
inline Vec3 lattice_point(int i) {
  constexpr double kPlastic = 1.22074408460575947536;  // positive root of x^4 = x + 1
  Vec3 point;
  double step = 1;
  for (int axis = 0; axis < 3; ++axis) {
    step /= kPlastic;
    const double x = 0.5 + step * i;
    point[axis] = static_cast<float>(x - std::floor(x)) * kOneMinusEpsilon;
  }
  return point;
}

}  // namespace covary
