// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/transform.h"

namespace covary {

/// Rotation or reflection of directions: the effect of `to_world` on a light without extent. Preserves lengths.
class Rotation {
 public:
  Rotation() = default;
  /// The linear part of `t` without its scale. Throws Error(kInput) if it is far from a similarity, which would distort
  /// directions.
  explicit Rotation(const Transform& t);
  /// Whether `t` was no similarity to the digits that files have, so that directions move by up to half a degree.
  bool is_nearest() const { return is_nearest_; }
  Vec3 to_world(const Vec3& v) const { return x_ * v.x + y_ * v.y + z_ * v.z; }
  Vec3 to_local(const Vec3& v) const { return {dot(x_, v), dot(y_, v), dot(z_, v)}; }

 private:
  Vec3 x_{1, 0, 0}, y_{0, 1, 0}, z_{0, 0, 1};  // images of the axes
  bool is_nearest_ = false;
};

}  // namespace covary
