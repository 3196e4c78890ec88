// SPDX-License-Identifier: Apache-2.0
// The map of the unit square onto the sphere of directions that keeps areas, as used by pbrt-v4: Clarberg's octahedral
// mapping (2008).
//
// With (x, y) in [-1, 1]^2 from the square's upper left corner, s = |x| + |y|, r = min(s, 2 - s) and phi = (pi / 4)
// (1 + (|y| - |x|) / r) in the first quadrant: |z| = 1 - r^2, z >= 0 inside the diamond s <= 1, and the direction's x
// and y have the signs of (x, y).
#pragma once

#include "core/vec.h"

namespace covary {

/// Direction of a point in the unit square, and the inverse.
Vec3 equal_area_direction(Vec2 uv);
Vec2 equal_area_square(const Vec3& d);

}  // namespace covary
