// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/frame.h"
#include "core/ray.h"
#include "core/warp.h"
#include "scene/emitter.h"

namespace covary {

/// Bounding sphere of the scene, for lights at infinity. The unit sphere until bounds are set.
struct SceneSphere {
  Vec3 center;
  float radius = 1;

  SceneSphere() = default;
  explicit SceneSphere(const Bounds3& bounds) : center(bounds.center()), radius(bounds.radius()) {
    if (!(radius > 0)) radius = 1;  // a scene that is a single point
  }

  float disk_area() const { return kPi * radius * radius; }
  /// Origin of a ray into the scene in direction `d`, uniform on the disk perpendicular to `d` that is tangent to the
  /// sphere and covers it; density 1 / disk_area() per unit area.
  Vec3 disk_point(const Vec3& d, Vec2 u) const {
    const Frame frame(d);
    const Vec2 offset = warp::square_to_disk(u);
    return center + (frame.s * offset.x + frame.t * offset.y - d) * radius;
  }
  /// Emission into the scene in direction `d`, whose density per unit solid angle is `pdf_direction`.
  EmissionSample emission(const Vec3& d, Vec2 u, const Spectrum& radiance, float pdf_direction) const {
    EmissionSample sample;
    sample.ray = {disk_point(d, u), d};
    sample.n = d;
    sample.radiance = radiance;
    sample.pdf_position = 1 / disk_area();
    sample.pdf_direction = pdf_direction;
    return sample;
  }
};

}  // namespace covary
