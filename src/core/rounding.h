// SPDX-License-Identifier: Apache-2.0
// Bounds of rounding errors, so that a ray that leaves a surface, or ends at one, does not hit it again [Pharr2023,
// Sec. 6.8]. They follow from how a point was computed, not from the size of the scene: a pane of glass stays a pane
// wherever it stands.
#pragma once

#include "core/ray.h"

namespace covary {

/// Largest relative error of rounding to float.
inline constexpr float kRounding = 0x1p-24f;

/// Distance along the unit normal `n` at which a ray can start from the surface point `p`. It covers the rounding of
/// the coordinates of `p` and of the ray's origin, and a little for this product. `slack` covers all other errors, in
/// units of kRounding: the distance along `n` by which the point may be off, and by which the ray tracer may misplace
/// the surface.
inline float surface_offset(const Vec3& p, const Vec3& n, float slack) {
  return kRounding * (2.25f * dot(abs(p), abs(n)) + slack);
}

/// `slack` of a point of a plane that is reached from one of its corners by `d`, all components positive. The plane is
/// spanned by e1 and e2, whose cross product has the reciprocal length `inverse`. The ray tracer's distance to a
/// triangle is the dot product of the vector to a corner and of the cross product of two edges; with the point, eight
/// numbers are rounded, whose errors hardly ever add up to more than four.
inline float plane_slack(const Vec3& d, const Vec3& e1, const Vec3& e2, float inverse) {
  const Vec3 a = abs(e1), b = abs(e2);
  return 4 * inverse * dot(d, Vec3{a.y * b.z + a.z * b.y, a.z * b.x + a.x * b.z, a.x * b.y + a.y * b.x});
}

/// Fraction by which hit points of a triangle, with a corner at p0, are moved towards its centre: enough to keep them
/// off surfaces that meet it at an edge, which rays from the edge itself would pass through. `inverse` as above.
inline float edge_margin(const Vec3& p0, const Vec3& e1, const Vec3& e2, float inverse) {
  const Vec3 reach = abs(e1) + abs(e2);
  return std::min(0.5f, 12 * kRounding * max_component(abs(p0) + reach) * max_component(reach) * inverse);
}

/// `p`, on a surface with unit geometric normal `ng`, moved by `offset` to the side of the surface that `w` points to.
inline Vec3 offset_origin(const Vec3& p, const Vec3& ng, float offset, const Vec3& w) {
  return p + ng * std::copysign(offset, dot(ng, w));
}

/// Where a ray ends that comes in direction `w` over the distance `length` to a surface point: as near to the surface
/// as the errors of its origin and direction allow.
inline Vec3 offset_target(const Vec3& p, const Vec3& ng, float offset, const Vec3& w, float length) {
  return offset_origin(p, ng, offset + 4 * kRounding * length, -w);
}

/// The ray from `o` to a point that is not on a surface, such as that of offset_target(). It has no length and no
/// direction if both are the same point, as where floats are so far apart that nothing is between a point and a light.
inline Ray ray_between(const Vec3& o, const Vec3& target) {
  const Vec3 d = target - o;
  const float distance = length(d);
  return {o, d * (distance > 0 ? 1 / distance : 0.0f), distance * (1 - 4 * kRounding)};
}

}  // namespace covary
