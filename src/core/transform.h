// SPDX-License-Identifier: Apache-2.0
// Affine and projective maps as 4 x 4 matrices with their inverses, in double precision because scenes chain many of
// them.
#pragma once

#include <array>

#include "core/ray.h"

namespace covary {

/// Row-major 4 x 4 matrix.
using Matrix4 = std::array<std::array<double, 4>, 4>;

class Transform {
 public:
  Transform();  ///< identity
  /// Throws Error(kInput) when the matrix is singular or not finite.
  explicit Transform(const Matrix4& matrix);

  static Transform translate(const Vec3& v);
  static Transform scale(const Vec3& v);
  /// Rotation by `degrees` around `axis` (of any nonzero length).
  static Transform rotate(const Vec3& axis, double degrees);
  /// Camera frame: origin at `origin`, +z towards `target`, y in the half plane of `up`; x points left as seen from the
  /// camera (Mitsuba's convention). Throws Error(kInput) when the directions are degenerate.
  static Transform look_at(const Vec3& origin, const Vec3& target, const Vec3& up);

  Vec3 point(const Vec3& p) const;   ///< with perspective division
  Vec3 vector(const Vec3& v) const;  ///< not normalised
  Vec3 normal(const Vec3& n) const;  ///< by the inverse transpose; not normalised
  Transform inverse() const;
  bool is_identity() const;
  bool flips_handedness() const;  ///< determinant of the linear part is negative
  const Matrix4& matrix() const { return m_; }
  Bounds3 bounds(const Bounds3& b) const;

  friend Transform operator*(const Transform& a, const Transform& b);  ///< first b, then a

 private:
  Transform(const Matrix4& m, const Matrix4& inverse) : m_(m), inverse_(inverse) {}
  Matrix4 m_, inverse_;
};

}  // namespace covary
