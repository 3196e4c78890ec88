// SPDX-License-Identifier: Apache-2.0
// Area lights. The shape owns its light (Shape::set_emitter); the light only refers to the shape. If a scene file uses
// one description for several shapes, each shape gets its own clone, which shares the texture.
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

struct AreaLightSettings {
  TexturePtr radiance;     ///< not null
  bool two_sided = false;  ///< emits on the side of the shading normal, or on both
  float power = 0;         ///< if positive, the factor on the radiance is such that 1 would emit this in all
  /// `power` is that of each triangle of a mesh, if all are of the same area, as in pbrt.
  bool per_triangle = false;
  bool hidden = false;  ///< rays pass through the surface
};

class AreaLight final : public Emitter {
 public:
  /// Emits uniformly over the hemispheres.
  explicit AreaLight(AreaLightSettings settings);
  explicit AreaLight(TexturePtr radiance) : AreaLight(AreaLightSettings{std::move(radiance)}) {}

  /// Sets the shape that emits; call once, when the shape is complete, before anything else but clone(). `shape` must
  /// outlive the light.
  void attach(const Shape* shape);
  /// The same light without a shape.
  std::shared_ptr<AreaLight> clone() const {
    const auto light = std::make_shared<AreaLight>(settings_);
    light->set_group(group());
    return light;
  }
  const Shape* shape() const override { return shape_; }
  const ParallelogramLight* parallelogram() const override { return parallelogram_ ? &*parallelogram_ : nullptr; }
  const SphereLight* sphere() const override { return sphere_ ? &*sphere_ : nullptr; }

  Spectrum surface_radiance(const SurfaceHit& hit, const Vec3& w) const override;
  /// Textured lights on shapes whose (u, v) cover the unit square (Shape::sample_uv) sample positions in proportion to
  /// the texture's luminance; all others use the shape's own sampling from the reference point.
  EmitterSample sample_towards(const Vec3& reference, Vec2 u, float u_primitive) const override;
  float pdf_solid_angle(const Vec3& reference, const SurfaceHit& hit) const override;
  uint32_t n_parts() const override { return shape_->n_parts(); }
  uint32_t part_of(const SurfaceHit& hit) const override { return n_parts() > 1 ? hit.primitive : 0; }
  EmitterSample sample_part_towards(uint32_t part, const Vec3& reference, Vec2 u, float u_primitive) const override;
  float pdf_part_solid_angle(const Vec3& reference, const SurfaceHit& hit) const override;
  Spectrum part_power(uint32_t part) const override;
  EmissionSample sample_emission(Vec2 u_position, Vec2 u_direction, float u_primitive) const override;
  EmissionPdf pdf_emission(const SurfaceHit& hit, const Vec3& w) const override;
  /// pi times the integral of radiance over the surface; by quadrature for textures.
  Spectrum power() const override;
  bool knows_power() const override { return !textured_; }
  bool emits_on_both_sides() const override { return settings_.two_sided; }
  /// Rays do not meet a hidden light, so that only sample_towards() and sample_emission() find it.
  bool is_delta_position() const override { return settings_.hidden; }

 private:
  /// A sampled surface point with its density per unit area.
  AreaSample sample_position(Vec2 u, float u_primitive) const;
  Spectrum radiance_at(const AreaSample& at) const;
  /// Converts the point to a sample from `reference` (density per unit solid angle).
  EmitterSample towards(const Vec3& reference, const AreaSample& at) const;

  /// Power by quadrature over `n_points` points given by position(u, u_primitive).
  template <typename Position>
  Spectrum power_of(int n_points, const Position& position) const;

  const Texture& radiance() const { return *settings_.radiance; }
  /// Factor by `power`; not known before the shape is prepared.
  float scale() const;
  Spectrum constant() const { return constant_ * scale(); }
  float n_sides() const { return settings_.two_sided ? 2 : 1; }
  /// Turns the sample's normal towards `reference`, if that side emits; false if it does not. Completes is_delta.
  bool emits_towards(EmitterSample& sample) const;

  AreaLightSettings settings_;
  Spectrum constant_;  // the radiance if it does not vary, before scale()
  bool textured_;
  bool samples_uv_ = false;
  const Shape* shape_ = nullptr;
  std::optional<ParallelogramLight> parallelogram_;
  std::optional<SphereLight> sphere_;
};

}  // namespace covary
