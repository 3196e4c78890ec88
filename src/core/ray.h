// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/vec.h"

namespace covary {

/// Half line `o + t d`, valid for t in [0, t_max]. `d` has unit length.
struct Ray {
  Vec3 o, d;
  float t_max = kInfinity;
  Vec3 at(float t) const { return o + d * t; }
};

/// Axis-aligned box; empty when made without arguments.
struct Bounds3 {
  Vec3 lower{kInfinity, kInfinity, kInfinity}, upper{-kInfinity, -kInfinity, -kInfinity};
  void extend(const Vec3& p) { lower = min(lower, p), upper = max(upper, p); }
  void extend(const Bounds3& b) { lower = min(lower, b.lower), upper = max(upper, b.upper); }
  bool empty() const { return !(lower.x <= upper.x); }
  Vec3 center() const { return (lower + upper) * 0.5f; }
  float radius() const { return empty() ? 0 : length(upper - lower) * 0.5f; }
};

}  // namespace covary
