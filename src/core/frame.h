// SPDX-License-Identifier: Apache-2.0
// Orthonormal frames, and trigonometry of directions in a local frame whose z axis is the normal.
#pragma once

#include "core/vec.h"

namespace covary {

/// Right-handed orthonormal frame (s, t, n).
struct Frame {
  Vec3 s{1, 0, 0}, t{0, 1, 0}, n{0, 0, 1};

  Frame() = default;
  Frame(const Vec3& s_, const Vec3& t_, const Vec3& n_) : s(s_), t(t_), n(n_) {}

  /// A frame around the unit normal `n` that varies continuously over the whole sphere except one small cap: the axes
  /// of a fixed frame (e1, e2, pole), rotated along the shortest arc from the pole to the normal. Continuity keeps
  /// common random numbers correlated: neighbouring pixels scatter in the same directions. The usual constructions jump
  /// where a coordinate changes sign, which is where the normals of walls lie.
  explicit Frame(const Vec3& normal) : n(normal) {
    constexpr Vec3 kPole{0.48f, 0.64f, 0.6f}, kE1{0.8f, -0.6f, 0}, kE2{0.36f, 0.48f, -0.8f};
    const float c = 1 + dot(n, kPole);
    if (c > 1e-2f) [[likely]] {
      const Vec3 h = (n + kPole) * (1 / c);
      s = kE1 - h * dot(n, kE1);
      t = kE2 - h * dot(n, kE2);
    } else {
      s = normalize(kE1 - n * dot(n, kE1));
      t = cross(n, s);
    }
  }

  /// A frame around `normal` whose s axis is the tangent orthogonalised against it; falls back to Frame(normal) when
  /// the tangent is parallel to the normal or zero.
  static Frame from_tangent(const Vec3& normal, const Vec3& tangent) {
    const Vec3 s = tangent - normal * dot(normal, tangent);
    const float l2 = length_squared(s);
    if (!(l2 > 1e-10f * length_squared(tangent))) return Frame(normal);
    const Vec3 su = s * (1 / std::sqrt(l2));
    return {su, cross(normal, su), normal};
  }

  Vec3 to_local(const Vec3& v) const { return {dot(v, s), dot(v, t), dot(v, n)}; }
  Vec3 to_world(const Vec3& v) const { return s * v.x + t * v.y + n * v.z; }
};

inline float cos_theta(const Vec3& w) { return w.z; }
inline float cos2_theta(const Vec3& w) { return w.z * w.z; }
inline float sin2_theta(const Vec3& w) { return std::max(0.0f, w.x * w.x + w.y * w.y); }
inline float sin_theta(const Vec3& w) { return std::sqrt(sin2_theta(w)); }
inline float tan2_theta(const Vec3& w) { return sin2_theta(w) / cos2_theta(w); }
/// Mirror direction about the z axis.
inline Vec3 reflect(const Vec3& w) { return {-w.x, -w.y, w.z}; }
/// Mirror direction about the unit vector `m`.
inline Vec3 reflect(const Vec3& w, const Vec3& m) { return m * (2 * dot(w, m)) - w; }

}  // namespace covary
