// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/vec.h"

namespace covary {

/// The points origin + u dp_du + v dp_dv, (u, v) in the unit square.
struct Parallelogram {
  Vec3 origin, dp_du, dp_dv, n;  ///< n: unit normal
  float inverse_area = 0;
  float slack = 0;  ///< of its points (core/rounding.h)
};

}  // namespace covary
