// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/transform.h"
#include "scene/volume.h"

namespace covary {

/// The same value everywhere. Its box is the unit cube moved by `to_world`, as in Mitsuba.
class ConstantVolume final : public Volume {
 public:
  explicit ConstantVolume(const Spectrum& value, const Transform& to_world = {})
      : value_(value), bounds_(to_world.bounds({{0, 0, 0}, {1, 1, 1}})) {}
  Spectrum eval(const Vec3&) const override { return value_; }
  Spectrum largest() const override { return value_; }
  Spectrum smallest() const override { return value_; }
  Bounds3 bounds() const override { return bounds_; }
  bool is_constant() const override { return true; }

 private:
  Spectrum value_;
  Bounds3 bounds_;
};

}  // namespace covary
