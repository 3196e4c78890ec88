// SPDX-License-Identifier: Apache-2.0
#include "scene/shape.h"

namespace covary {
Spectrum SurfaceHit::vertex_colour() const { return shape->vertex_colour(*this); }

EmitterSample Shape::sample_towards(const Vec3& reference, Vec2 u, float u_primitive) const {
  return towards(reference, sample_area(u, u_primitive));
}

float Shape::pdf_solid_angle(const Vec3& reference, const SurfaceHit& hit) const {
  const Vec3 d = hit.p - reference;
  const float d2 = length_squared(d), cosine = std::abs(dot(d, hit.ng)) / std::sqrt(d2);
  return d2 > 0 && cosine > kGrazing ? d2 / (cosine * area()) : 0;
}

}  // namespace covary
