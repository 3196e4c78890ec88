// SPDX-License-Identifier: Apache-2.0
// `area`: an emissive surface, nested in a shape.
//
// | parameter    | type            | default | meaning                                                        |
// |--------------|-----------------|---------|----------------------------------------------------------------|
// | radiance     | colour, texture | 1       | emitted on the side of the shape's (perhaps flipped) normal    |
// | two_sided    | boolean         | false   | our own: emitted on both sides                                 |
// | power        | float           | none    | our own: `radiance` times the radiance that has this power     |
// | per_triangle | boolean         | false   | `power` is that of the mean triangle of a mesh                 |
// | hidden       | boolean         | false   | our own: rays pass through the surface, which shines all the   |
// |              |                 |         | same; mirrors and cameras do not see it                        |
#include "emitters/area.h"

#include "core/warp.h"
#include "emitters/lattice.h"
#include "emitters/registry.h"
#include "scene/analytic_shape.h"
#include "scene/mesh.h"

namespace covary {
namespace {

/// Unit geometric normal on the side of the shading normal: the front that the BSDF has, too, whatever the order of a
/// mesh's vertices.
Vec3 front_normal(const SurfaceHit& hit) { return dot(hit.ng, hit.frame.n) < 0 ? -hit.ng : hit.ng; }

}  // namespace

AreaLight::AreaLight(AreaLightSettings settings)
    : settings_(std::move(settings)), textured_(!settings_.radiance->is_constant()) {
  if (!textured_) constant_ = radiance().eval(SurfaceHit{});
}

void AreaLight::attach(const Shape* shape) {
  COVARY_CHECK(shape != nullptr && shape_ == nullptr, "an area light belongs to exactly one shape");
  shape_ = shape;
  const bool plain = !textured_ && !settings_.two_sided && !settings_.hidden && !(settings_.power > 0);
  samples_uv_ = textured_ && shape->sample_uv({0.5f, 0.5f}).pdf_area > 0;
  if (const auto* mesh = dynamic_cast<const TriangleMesh*>(shape); mesh && plain && mesh->parallelogram())
    parallelogram_ = {*mesh->parallelogram(), constant_};
  if (const auto* sphere = dynamic_cast<const Sphere*>(shape); sphere && plain) sphere_ = {sphere->ball(), constant_};
}

Spectrum AreaLight::surface_radiance(const SurfaceHit& hit, const Vec3& w) const {
  if (!settings_.two_sided && !(dot(front_normal(hit), w) > 0)) return Spectrum();
  return textured_ ? radiance().eval(hit) * scale() : constant();
}

Spectrum AreaLight::radiance_at(const AreaSample& at) const {
  if (!textured_) return constant();
  SurfaceHit hit;
  hit.p = at.p, hit.ng = at.n, hit.frame = Frame(at.n), hit.uv = at.uv, hit.shape = shape_;
  hit.primitive = at.primitive, hit.barycentric = at.barycentric;
  return radiance().eval(hit) * scale();
}

float AreaLight::scale() const {
  if (!(settings_.power > 0)) return 1;
  const auto n = settings_.per_triangle ? static_cast<float>(shape_->n_primitives()) : 1.0f;
  return settings_.power * n / (kPi * n_sides() * shape_->area());
}

bool AreaLight::emits_towards(EmitterSample& sample) const {
  sample.is_delta = settings_.hidden;
  if (!(sample.pdf_solid_angle > 0)) return false;
  const float cosine = dot(sample.n, sample.wi);
  if (settings_.two_sided && cosine > 0) sample.n = -sample.n;
  return settings_.two_sided ? cosine != 0 : cosine < 0;
}

AreaSample AreaLight::sample_position(Vec2 u, float u_primitive) const {
  if (!samples_uv_) return shape_->sample_area(u, u_primitive);
  const Texture::PositionSample position = radiance().sample_position(u);
  AreaSample area = shape_->sample_uv(position.uv);
  area.pdf_area *= position.pdf;
  return area;
}

EmitterSample AreaLight::sample_towards(const Vec3& reference, Vec2 u, float u_primitive) const {
  // Meshes with colours are sampled by area: their colour depends on the triangle, which an EmitterSample does not
  // store.
  if (samples_uv_ || (textured_ && shape_->has_attributes()))
    return towards(reference, sample_position(u, u_primitive));
  EmitterSample sample = shape_->sample_towards(reference, u, u_primitive);
  if (emits_towards(sample)) sample.radiance = radiance_at({sample.p, sample.n, sample.uv});
  return sample;
}

EmitterSample AreaLight::towards(const Vec3& reference, const AreaSample& at) const {
  EmitterSample sample = Shape::towards(reference, at);
  if (emits_towards(sample)) sample.radiance = radiance_at(at);
  return sample;
}

EmitterSample AreaLight::sample_part_towards(uint32_t part, const Vec3& reference, Vec2 u, float u_primitive) const {
  if (n_parts() == 1) return sample_towards(reference, u, u_primitive);
  return towards(reference, shape_->sample_part(part, u));
}

float AreaLight::pdf_part_solid_angle(const Vec3& reference, const SurfaceHit& hit) const {
  if (n_parts() == 1) return pdf_solid_angle(reference, hit);
  const Vec3 d = hit.p - reference;
  const float distance_squared = length_squared(d);
  const float cosine = std::abs(dot(d, hit.ng)) / std::sqrt(distance_squared);
  return distance_squared > 0 && cosine > Shape::kGrazing
             ? distance_squared / (cosine * shape_->part_area(part_of(hit)))
             : 0;
}

float AreaLight::pdf_solid_angle(const Vec3& reference, const SurfaceHit& hit) const {
  if (!samples_uv_) return shape_->pdf_solid_angle(reference, hit);
  const Vec3 d = hit.p - reference;
  const float distance_squared = length_squared(d);
  const float cosine = std::abs(dot(d, hit.ng)) / std::sqrt(distance_squared);
  const float pdf_area = radiance().pdf_position(hit.uv) * shape_->sample_uv(hit.uv).pdf_area;
  return cosine > 0 ? pdf_area * distance_squared / cosine : 0;
}

EmissionSample AreaLight::sample_emission(Vec2 u_position, Vec2 u_direction, float u_primitive) const {
  EmissionSample sample;
  AreaSample area = sample_position(u_position, u_primitive);
  if (settings_.two_sided) {
    const bool back = u_direction.x >= 0.5f;
    u_direction.x = std::min(2 * u_direction.x - (back ? 1.0f : 0.0f), kOneMinusEpsilon);
    if (back) area.n = -area.n;
  }
  const Vec3 w = warp::square_to_cosine_hemisphere(u_direction);
  if (!(area.pdf_area > 0) || !(w.z > 0)) return sample;
  sample.ray = {area.p, Frame(area.n).to_world(w)};
  sample.n = area.n;
  sample.offset = surface_offset(area.p, area.n, area.slack);
  sample.uv = area.uv;
  sample.radiance = radiance_at(area);
  sample.pdf_position = area.pdf_area;
  sample.pdf_direction = warp::cosine_hemisphere_pdf_solid_angle(w.z) / n_sides();
  return sample;
}

EmissionPdf AreaLight::pdf_emission(const SurfaceHit& hit, const Vec3& w) const {
  const float position =
      samples_uv_ ? radiance().pdf_position(hit.uv) * shape_->sample_uv(hit.uv).pdf_area : 1 / shape_->area();
  const float cosine = dot(front_normal(hit), w);
  return {position,
          warp::cosine_hemisphere_pdf_solid_angle(settings_.two_sided ? std::abs(cosine) : cosine) / n_sides()};
}

template <typename Position>
Spectrum AreaLight::power_of(int n_points, const Position& position) const {
  double sum[3] = {0, 0, 0};  // of radiance over density
  for (int i = 0; i < n_points; ++i) {
    const Vec3 u = lattice_point(i);
    const AreaSample at = position({u.x, u.y}, u.z);
    if (!(at.pdf_area > 0)) continue;
    const Spectrum radiance = radiance_at(at);
    for (int c = 0; c < 3; ++c) sum[c] += radiance[c] / at.pdf_area;
  }
  const double scale = static_cast<double>(kPi * n_sides()) / n_points;
  return {static_cast<float>(sum[0] * scale), static_cast<float>(sum[1] * scale), static_cast<float>(sum[2] * scale)};
}

Spectrum AreaLight::power() const {
  if (!textured_) return constant() * (kPi * n_sides() * shape_->area());
  return power_of(4096, [&](Vec2 u, float u_primitive) { return sample_position(u, u_primitive); });
}

Spectrum AreaLight::part_power(uint32_t part) const {
  if (n_parts() == 1) return power();
  if (!textured_) return constant() * (kPi * n_sides() * shape_->part_area(part));
  return power_of(64, [&](Vec2 u, float) { return shape_->sample_part(part, u); });
}

std::shared_ptr<Emitter> make_area(Parameters& parameters) {
  AreaLightSettings settings;
  settings.radiance = parameters.get_texture("radiance", Spectrum(1), SpectrumRole::kEmission);
  settings.two_sided = parameters.get_bool("two_sided", false);
  settings.hidden = parameters.get_bool("hidden", false);
  settings.power = parameters.get_float("power", 0, 0);
  settings.per_triangle = parameters.get_bool("per_triangle", false);
  if (!settings.radiance) return nullptr;  // already reported
  return std::make_shared<AreaLight>(std::move(settings));
}

}  // namespace covary
