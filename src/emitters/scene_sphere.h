// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/frame.h"
#include "core/ray.h"
#include "core/warp.h"
#include "scene/emitter.h"

namespace covary {

/// Bounding sphere of the scene, for lights infinitely far away. The unit sphere until bounds are known.
struct SceneSphere {
  Vec3 center;
  float radius = 1;

  SceneSphere() = default;
  explicit SceneSphere(const Bounds3& bounds) : center(bounds.center()), radius(bounds.radius()) {
    if (!(radius > 0)) radius = 1;  // a scene that is a single point
  }

  float disk_area() const { return kPi * radius * radius; }
  /// Origin of a ray in direction `d` into the scene, uniform on the disk perpendicular to `d` that touches the sphere
  /// from outside and covers it; density 1 / disk_area() per unit area of the disk.
  Vec3 disk_point(const Vec3& d, Vec2 u) const {
    const Frame frame(d);
    const Vec2 offset = warp::square_to_disk(u);
    return center + (frame.s * offset.x + frame.t * offset.y - d) * radius;
  }
  /// Light that enters the scene in direction `d`, which has the density `pdf_direction` per unit solid angle.
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
