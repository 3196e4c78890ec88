// SPDX-License-Identifier: Apache-2.0
#include "scene/shape.h"

namespace covary {
namespace {

/// Area density to density per unit solid angle at a point `distance_squared` away; 0 for grazing directions.
float area_to_solid_angle(float pdf_area, float distance_squared, float cosine) {
  return cosine > 1e-12f ? pdf_area * distance_squared / cosine : 0;
}

}  // namespace

Spectrum SurfaceHit::vertex_colour() const { return shape->vertex_colour(*this); }

EmitterSample Shape::sample_towards(const Vec3& reference, Vec2 u, float u_primitive) const {
  const AreaSample area = sample_area(u, u_primitive);
  const Vec3 d = area.p - reference;
  const float d2 = length_squared(d);
  EmitterSample sample;
  if (!(d2 > 0) || !(area.pdf_area > 0)) return sample;
  sample.distance = std::sqrt(d2);
  sample.wi = d * (1 / sample.distance);
  sample.p = area.p, sample.n = area.n, sample.uv = area.uv;
  sample.pdf_solid_angle = area_to_solid_angle(area.pdf_area, d2, std::abs(dot(sample.wi, area.n)));
  return sample;
}

float Shape::pdf_solid_angle(const Vec3& reference, const SurfaceHit& hit) const {
  const Vec3 d = hit.p - reference;
  const float d2 = length_squared(d);
  return d2 > 0 ? area_to_solid_angle(1 / area(), d2, std::abs(dot(d, hit.ng)) / std::sqrt(d2)) : 0;
}

}  // namespace covary
