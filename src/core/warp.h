// SPDX-License-Identifier: Apache-2.0
// Maps from the unit square to domains used in light transport, each with its density. All maps are continuous almost
// everywhere, which keeps common random numbers correlated.
#pragma once

#include "core/trigonometry.h"
#include "core/vec.h"

namespace covary::warp {

/// Uniform on the unit disk by the concentric map (Shirley & Chiu 1997); density 1/pi per unit area.
inline Vec2 square_to_disk(Vec2 u) {
  const float x = 2 * u.x - 1, y = 2 * u.y - 1;
  // Radius along the larger coordinate; the angle is measured from its axis, within 45 degrees. Which coordinate is
  // larger is unpredictable, so values are selected instead of branching.
  const bool along_x = std::abs(x) > std::abs(y);
  const float radius = along_x ? x : y, other = along_x ? y : x;
  const SinCos a = sincos_octant((kPi / 4) * (other / (radius == 0 ? 1 : radius)));
  const float near = radius * a.cos, far = radius * a.sin;
  return {along_x ? near : far, along_x ? far : near};
}

/// Cosine-weighted on the upper hemisphere; density cos(theta)/pi per unit solid angle.
inline Vec3 square_to_cosine_hemisphere(Vec2 u) {
  const Vec2 d = square_to_disk(u);
  return {d.x, d.y, safe_sqrt(1 - d.x * d.x - d.y * d.y)};
}
inline float cosine_hemisphere_pdf_solid_angle(float cos_theta) { return cos_theta > 0 ? cos_theta * kInvPi : 0; }

/// Uniform on the unit sphere; density 1/(4 pi) per unit solid angle.
inline Vec3 square_to_sphere(Vec2 u) {
  const float z = 1 - 2 * u.y, r = safe_sqrt(1 - z * z);
  const SinCos phi = sincos_turns(u.x);
  return {r * phi.cos, r * phi.sin, z};
}
inline float sphere_pdf_solid_angle() { return 1 / (4 * kPi); }

/// The direction of square_to_cone() above `d` on the unit disk. `one_minus_cos`: |d|^2 one_minus_cos_max, which is
/// uniform in [0, one_minus_cos_max).
inline Vec3 disk_to_cone(Vec2 d, float one_minus_cos, float one_minus_cos_max) {
  const float scale = safe_sqrt(one_minus_cos_max * (2 - one_minus_cos));  // sin(theta) / |d|
  return {d.x * scale, d.y * scale, 1 - one_minus_cos};
}
/// Uniform in the cone of directions around +z whose cosine is at least `cos_max`. Takes `one_minus_cos_max` because it
/// is tiny for distant lights, and computing it from cos_max would cancel.
inline Vec3 square_to_cone(Vec2 u, float one_minus_cos_max) {
  const Vec2 d = square_to_disk(u);
  const float r2 = d.x * d.x + d.y * d.y;  // uniform in [0, 1)
  return disk_to_cone(d, r2 * one_minus_cos_max, one_minus_cos_max);
}
inline float cone_pdf_solid_angle(float one_minus_cos_max) { return 1 / (kTwoPi * one_minus_cos_max); }

/// Barycentric coordinates (b1, b2) uniform on a triangle; density 1/area per unit area.
inline Vec2 square_to_triangle(Vec2 u) {
  const float t = safe_sqrt(1 - u.x);
  return {1 - t, t * u.y};
}

/// Tent of radius `radius` centred at 0; density (1 - |x|/radius)/radius.
inline float interval_to_tent(float u, float radius) {
  const float from_end = radius * (1 - std::sqrt(2 * std::min(u, 1 - u)));
  return u < 0.5f ? -from_end : from_end;
}

}  // namespace covary::warp
