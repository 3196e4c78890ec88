// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/frame.h"
#include "core/vec.h"

namespace covary {

/// A sphere; `sign`: 1 where its normals point outwards, -1 inwards.
struct Ball {
  Vec3 center;
  float radius = 0, sign = 1;

  // Sampling of the cone that the sphere subtends at a point, without branches, for loops over many points.

  /// Squared sine of half of its opening angle; 1 or more, or NaN, where there is no such cone: not from outside.
  float squared_sine(const Vec3& reference) const { return radius * radius / length_squared(center - reference); }
  /// 1 - cos of that angle, without cancellation.
  static float one_minus_cos(float squared_sine) { return squared_sine / (1 + safe_sqrt(1 - squared_sine)); }
  /// In the world, of a direction around that of the centre.
  Vec3 direction(const Vec3& reference, const Vec3& local) const {
    const Vec3 to_center = center - reference;
    return Frame(to_center * (1 / std::sqrt(length_squared(to_center)))).to_world(local);
  }
  /// Of the nearer intersection. Relative to the point of the ray nearest to the centre, without cancellation.
  float distance(const Vec3& reference, const Vec3& wi) const {
    const Vec3 to_center = center - reference;
    const float b = dot(to_center, wi);
    return b - safe_sqrt(radius * radius - length_squared(wi * b - to_center));
  }
  /// Unit vector from the centre to the point at `distance`.
  Vec3 outward(const Vec3& reference, const Vec3& wi, float distance) const {
    return normalize(wi * distance - (center - reference));
  }
  /// Of its points (core/rounding.h): that of the vector from the centre, which is normalised.
  float slack() const { return 6 * radius; }
};

}  // namespace covary
