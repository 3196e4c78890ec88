// SPDX-License-Identifier: Apache-2.0
// Surfaces. Ray intersection itself is in ray_tracer.h; a Shape describes its points and samples its area.
#pragma once

#include <cstdint>
#include <memory>
#include <string_view>

#include "core/ray.h"
#include "core/rounding.h"
#include "core/transform.h"
#include "scene/bsdf.h"
#include "scene/emitter.h"
#include "scene/medium.h"
#include "scene/object.h"
#include "scene/surface_hit.h"

namespace covary {

struct AreaSample {
  Vec3 p, n;  ///< point and unit geometric normal on the side of the shading normal
  Vec2 uv;
  float pdf_area = 0;      ///< per unit area
  uint32_t primitive = 0;  ///< triangle index within a mesh
  Vec2 barycentric;        ///< weights of the triangle's 2nd and 3rd vertex
  float slack = 0;         ///< bound of errors of p (core/rounding.h)
};

class Shape : public SceneObject {
 public:
  virtual Bounds3 bounds() const = 0;
  /// Completes a hit on this shape: p, ng, offset, frame and uv (and dp_du, dp_dv, with the frame aligned to dp_du, if
  /// `with_derivatives`) from the t, primitive and barycentric set by the ray tracer.
  virtual void fill(const Ray& ray, SurfaceHit& hit, bool with_derivatives) const = 0;
  virtual float area() const = 0;
  virtual size_t n_primitives() const { return 1; }
  /// Uniform by area. `u_primitive` selects a part (triangle).
  virtual AreaSample sample_area(Vec2 u, float u_primitive) const = 0;
  /// Number of parts that can be sampled separately: the triangles of a mesh; 1 if the shape is sampled as a whole.
  virtual uint32_t n_parts() const { return 1; }
  /// Number of triangles in a part; 1 if there are none.
  virtual uint32_t triangles_per_part() const { return 1; }
  virtual float part_area(uint32_t /*part*/) const { return area(); }
  /// Uniform by area on one part.
  virtual AreaSample sample_part(uint32_t /*part*/, Vec2 u) const { return sample_area(u, 0); }
  /// Bounds of one part, for spatial grouping.
  virtual Bounds3 part_bounds(uint32_t /*part*/) const { return bounds(); }
  /// The AreaSample::n of a flat part; zero if it varies.
  virtual Vec3 part_normal(uint32_t /*part*/) const { return {}; }
  /// Point with given surface parameters (for textured lights): only for shapes whose (u, v) cover the unit square
  /// once. Its pdf_area is for a density of 1 per unit (u, v) area; pdf_area == 0: not supported by this shape.
  virtual AreaSample sample_uv(Vec2 /*uv*/) const { return {}; }
  /// Samples the shape as seen from `reference`; default: uniform by area. The pdf is per unit solid angle at
  /// `reference`.
  virtual EmitterSample sample_towards(const Vec3& reference, Vec2 u, float u_primitive) const;
  virtual float pdf_solid_angle(const Vec3& reference, const SurfaceHit& hit) const;
  /// Converts a point sampled by area to a sample from `reference`, with its pdf in solid angle; pdf 0 at grazing
  /// angles.
  static EmitterSample towards(const Vec3& reference, const AreaSample& area) {
    EmitterSample sample;
    const Vec3 d = area.p - reference;
    const float d2 = length_squared(d);
    if (!(d2 > 0) || !(area.pdf_area > 0)) return sample;
    const float inverse = 1 / std::sqrt(d2);
    sample.distance = d2 * inverse;
    sample.wi = d * inverse;
    sample.p = area.p, sample.n = area.n, sample.uv = area.uv;
    sample.offset = surface_offset(area.p, area.n, area.slack);
    const float cosine = std::abs(dot(sample.wi, area.n));
    sample.pdf_solid_angle = cosine > kGrazing ? area.pdf_area * d2 / cosine : 0;
    return sample;
  }
  /// Interpolated vertex colour ("vertex_color"), white if the mesh has none.
  virtual Spectrum vertex_colour(const SurfaceHit& /*hit*/) const { return Spectrum(1); }
  virtual bool has_vertex_colour() const { return false; }
  /// A mesh attribute by name, such as "face_color", interpolated if per vertex; white if the mesh does not have it.
  virtual Spectrum attribute(std::string_view /*name*/, const SurfaceHit& /*hit*/) const { return Spectrum(1); }
  virtual bool has_attribute(std::string_view /*name*/) const { return false; }
  /// Whether there are any attributes or vertex colours.
  virtual bool has_attributes() const { return false; }
  /// Whether it can be a light, i.e. implements area() and the sampling functions.
  virtual bool can_emit() const { return true; }

  /// Cosines below this count as zero.
  static constexpr float kGrazing = 1e-12f;

  /// A transformed copy, without BSDF and emitter. Throws Error(kInput) if the shape does not support the
  /// transformation.
  virtual std::shared_ptr<Shape> transformed(const Transform& to_world) const = 0;

  /// Copies the BSDF and the media of another shape.
  void share_surface(const Shape& other) {
    set_bsdf(other.bsdf_);
    set_media(other.interior_, other.exterior_);
  }
  const Bsdf* bsdf() const { return bsdf_.get(); }
  const Emitter* emitter() const { return emitter_.get(); }
  const std::shared_ptr<const Emitter>& shared_emitter() const { return emitter_; }
  void set_bsdf(BsdfPtr bsdf) {
    bsdf_ = std::move(bsdf);
    needs_derivatives_ = bsdf_ && bsdf_->needs_derivatives();
    bsdf_flags_ = bsdf_ ? bsdf_->flags() : 0;
    main_texture_ = bsdf_ ? bsdf_->main_texture() : nullptr;
  }
  /// Cached flags and main texture of bsdf().
  uint32_t bsdf_flags() const { return bsdf_flags_; }
  const Texture* main_texture() const { return main_texture_; }
  /// Whether hits on this shape need dp_du, dp_dv and an aligned frame.
  bool needs_derivatives() const { return needs_derivatives_; }
  /// The media on both sides of the surface; null: none or unknown. `interior` is on the side opposite the geometric
  /// normal.
  void set_media(MediumPtr interior, MediumPtr exterior) {
    bounds_medium_ = interior || exterior;
    interior_ = std::move(interior), exterior_ = std::move(exterior);
  }
  /// Whether the media on its sides may differ from the one that a ray comes through.
  bool bounds_medium() const { return bounds_medium_; }
  /// The medium that `w` leads into from a point with geometric normal `ng`.
  const Medium* medium_towards(const Vec3& ng, const Vec3& w) const {
    return (dot(ng, w) > 0 ? exterior_ : interior_).get();
  }
  void set_emitter(std::shared_ptr<const Emitter> emitter) { emitter_ = std::move(emitter); }

 private:
  BsdfPtr bsdf_;
  bool needs_derivatives_ = false;
  uint32_t bsdf_flags_ = 0;
  const Texture* main_texture_ = nullptr;
  std::shared_ptr<const Emitter> emitter_;
  MediumPtr interior_, exterior_;
  bool bounds_medium_ = false;
};

using ShapePtr = std::shared_ptr<Shape>;

}  // namespace covary
