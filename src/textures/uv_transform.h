// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/transform.h"

namespace covary {

/// Affine map of surface parameters (u, v): the parameter `to_uv`. Uses rows and columns x, y and the translation of a
/// 4 x 4 matrix, like Mitsuba 3.
class UvTransform {
 public:
  UvTransform() = default;
  explicit UvTransform(const Transform& t) {
    for (int i = 0; i < 2; ++i) {
      a_[i][0] = static_cast<float>(t.matrix()[i][0]);
      a_[i][1] = static_cast<float>(t.matrix()[i][1]);
      b_[i] = static_cast<float>(t.matrix()[i][3]);
    }
  }

  Vec2 apply(Vec2 uv) const {
    return {a_[0][0] * uv.x + a_[0][1] * uv.y + b_[0], a_[1][0] * uv.x + a_[1][1] * uv.y + b_[1]};
  }
  /// Gradient with respect to (u, v) of a function whose gradient with respect to apply(u, v) is `g`.
  Vec2 chain(Vec2 g) const { return {a_[0][0] * g.x + a_[1][0] * g.y, a_[0][1] * g.x + a_[1][1] * g.y}; }

  /// Whether it maps the unit square to itself: flips, transposition, quarter turns.
  bool permutes_unit_square() const {
    int corners_hit = 0;
    for (int i = 0; i < 4; ++i) {
      const Vec2 image = apply({static_cast<float>(i & 1), static_cast<float>(i >> 1)});
      for (int j = 0; j < 4; ++j) {
        const Vec2 difference = image - Vec2{static_cast<float>(j & 1), static_cast<float>(j >> 1)};
        if (dot(difference, difference) < 1e-8f) corners_hit |= 1 << j;
      }
    }
    return corners_hit == 15;
  }
  /// Inverse of apply(); only if permutes_unit_square(), where the linear part is orthogonal.
  Vec2 apply_inverse(Vec2 st) const { return chain({st.x - b_[0], st.y - b_[1]}); }

 private:
  float a_[2][2] = {{1, 0}, {0, 1}};
  float b_[2] = {0, 0};
};

}  // namespace covary
