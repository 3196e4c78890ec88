// SPDX-License-Identifier: Apache-2.0
// Light emitted by a surface. The shape owns its light (Shape::set_emitter); the light only refers to the shape. A
// scene file may use one description for several shapes: each shape then gets its own clone, which shares the texture.
//
//     auto light = prototype.clone();
//     light->attach(shape.get());
//     shape->set_emitter(light);
#pragma once

#include <memory>
#include <optional>

#include "scene/emitter.h"
#include "scene/shape.h"
#include "scene/texture.h"

namespace covary {

class AreaLight final : public Emitter {
 public:
  /// `radiance` must not be null. Emits on the side the geometric normal points to, equally in all directions of it.
  explicit AreaLight(TexturePtr radiance);

  /// Sets the surface that emits; call it once, when the shape is complete, before anything else but clone(). `shape`
  /// must outlive the light.
  void attach(const Shape* shape);
  /// The same light without a shape.
  std::shared_ptr<AreaLight> clone() const {
    const auto light = std::make_shared<AreaLight>(radiance_);
    light->set_group(group());
    return light;
  }
  const Shape* shape() const override { return shape_; }
  const ParallelogramLight* parallelogram() const override { return parallelogram_ ? &*parallelogram_ : nullptr; }
  const SphereLight* sphere() const override { return sphere_ ? &*sphere_ : nullptr; }

  Spectrum surface_radiance(const SurfaceHit& hit, const Vec3& w) const override;
  /// Textured lights on shapes whose (u, v) cover the unit square (Shape::sample_uv): positions in proportion to the
  /// texture's luminance. All others: as the shape likes best from the reference point.
  EmitterSample sample_towards(const Vec3& reference, Vec2 u, float u_primitive) const override;
  float pdf_solid_angle(const Vec3& reference, const SurfaceHit& hit) const override;
  uint32_t n_parts() const override { return shape_->n_parts(); }
  uint32_t part_of(const SurfaceHit& hit) const override { return n_parts() > 1 ? hit.primitive : 0; }
  EmitterSample sample_part_towards(uint32_t part, const Vec3& reference, Vec2 u, float u_primitive) const override;
  float pdf_part_solid_angle(const Vec3& reference, const SurfaceHit& hit) const override;
  Spectrum part_power(uint32_t part) const override;
  EmissionSample sample_emission(Vec2 u_position, Vec2 u_direction, float u_primitive) const override;
  EmissionPdf pdf_emission(const SurfaceHit& hit, const Vec3& w) const override;
  /// pi times the integral of the radiance over the surface; for textures by quadrature.
  Spectrum power() const override;
  bool knows_power() const override { return !textured_; }

 private:
  /// A point chosen by position only, with its density per unit area.
  AreaSample sample_position(Vec2 u, float u_primitive) const;
  Spectrum radiance_at(const AreaSample& at) const;
  /// The point as seen from `reference`.
  EmitterSample towards(const Vec3& reference, const AreaSample& at) const;

  /// Power by quadrature with so many points that position(u, u_primitive) gives.
  template <typename Position>
  Spectrum power_of(int n_points, const Position& position) const;

  TexturePtr radiance_;
  Spectrum constant_;  // the radiance where it does not vary
  bool textured_;
  bool samples_uv_ = false;
  const Shape* shape_ = nullptr;
  std::optional<ParallelogramLight> parallelogram_;
  std::optional<SphereLight> sphere_;
};

}  // namespace covary
