// SPDX-License-Identifier: Apache-2.0
// Light sources. The density of each technique can be queried separately, and its name gives the measure.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <utility>

#include "core/parallelogram.h"
#include "core/ray.h"
#include "core/spectrum.h"
#include "core/sphere.h"
#include "scene/object.h"
#include "scene/surface_hit.h"

namespace covary {

/// A point on a light as seen from a reference point.
struct EmitterSample {
  Vec3 wi;                     ///< unit direction from the reference point to the light
  float distance = kInfinity;  ///< to the light; infinite for environments and directional lights
  Vec3 p, n;         ///< point on the light and unit geometric normal of the side that emits, unless infinitely far
  Vec2 uv;           ///< surface parameters of p (area lights)
  float offset = 0;  ///< as SurfaceHit::offset; 0: not on a surface
  /// Emitted towards the reference point; for delta lights, the irradiance on a surface facing wi, already divided by
  /// the squared distance.
  Spectrum radiance;
  /// Density of wi at the reference point; 1 (a discrete probability) for delta lights; 0: sampling failed.
  float pdf_solid_angle = 0;
  bool is_delta = false;  ///< position or direction is a delta; BSDF sampling cannot hit the light
};

/// Start of a light path.
struct EmissionSample {
  Ray ray;  ///< leaves the light
  Vec3 n;   ///< unit normal at the origin, on the emitting side; the direction for point-like and infinite lights
  Vec2 uv;  ///< surface parameters of the origin (area lights)
  float offset = 0;   ///< as SurfaceHit::offset, of the origin; 0: not on a surface
  Spectrum radiance;  ///< emitted radiance (area, environment) or intensity (point-like)
  /// Per unit area; for infinite lights per unit area of the disk perpendicular to the ray; 1 if delta.
  float pdf_position = 0;
  float pdf_direction = 0;  ///< per unit solid angle; 1 if delta
  bool delta_position = false, delta_direction = false;
};

/// Densities of Emitter::sample_emission(), in the units of EmissionSample; 1 for deltas.
struct EmissionPdf {
  float position = 0;
  float direction = 0;
};

/// A point on an area light, with what Emitter's densities need.
inline SurfaceHit point_on_light(const Vec3& p, const Vec3& n, Vec2 uv) {
  SurfaceHit hit;
  hit.p = p, hit.ng = n, hit.frame = Frame(n), hit.uv = uv;
  return hit;
}

/// A flat area light that is sampled uniformly and emits constant radiance on the side of its normal.
struct ParallelogramLight {
  Parallelogram surface;
  Spectrum radiance;
};

/// A sphere that emits the same radiance everywhere, sampled as it is seen.
struct SphereLight {
  Ball surface;
  Spectrum radiance;
};

/// Light from infinitely far away in one direction.
struct EnvironmentLight {
  Spectrum radiance;
  float pdf_solid_angle = 0;  ///< density of sample_towards() at the direction
};

/// Samples of an environment for up to kCapacity points, as structure of arrays.
struct EnvironmentSamples {
  static constexpr int kCapacity = 64;
  int size = 0;
  // Numbers, uniform in [0, 1)^2, that the samples are made from.
  alignas(64) float u_x[kCapacity] = {}, u_y[kCapacity] = {};
  // As in EmitterSample.
  alignas(64) float wi_x[kCapacity], wi_y[kCapacity], wi_z[kCapacity];
  alignas(64) float r[kCapacity], g[kCapacity], b[kCapacity], pdf_solid_angle[kCapacity];
};

class Emitter : public SceneObject {
 public:
  /// Light group for compositing: its id in the scene file; empty if none.
  const std::string& group() const { return group_; }
  void set_group(std::string group) { group_ = std::move(group); }
  /// The light in a scene whose hittable geometry has these bounds (never of zero radius). Lights at infinity return a
  /// copy that knows the scene's position; null: the light itself.
  virtual std::shared_ptr<const Emitter> in_scene(const Bounds3& /*bounds*/) const { return nullptr; }
  /// Lights at infinity that a ray leaving the scene can hit (environment map, constant).
  virtual bool is_environment() const { return false; }
  /// All light is emitted from one point, or from a surface that rays do not meet (AreaLightSettings::hidden).
  virtual bool is_delta_position() const { return false; }
  /// All light travels in one direction.
  virtual bool is_delta_direction() const { return false; }
  /// Position or direction is a delta: only sample_towards() can find this light.
  bool is_delta() const { return is_delta_position() || is_delta_direction(); }
  /// Light from infinitely far away: emission rays start on a disk outside the scene.
  bool is_infinite() const { return is_environment() || is_delta_direction(); }

  /// Radiance that an area light emits from a hit on its own shape in world direction `w` (away from the surface).
  virtual Spectrum surface_radiance(const SurfaceHit& /*hit*/, const Vec3& /*w*/) const { return {}; }
  /// Radiance along a ray leaving the scene in world direction `d`; environments only.
  virtual EnvironmentLight environment(const Vec3& /*d*/) const { return {}; }

  /// Samples the light as seen from `reference`. `u` uniform in [0,1)^2, `u_primitive` a third number.
  virtual EmitterSample sample_towards(const Vec3& reference, Vec2 u, float u_primitive) const = 0;
  /// Density of sample_towards() per unit solid angle at `reference` for the point `hit` on this area light.
  virtual float pdf_solid_angle(const Vec3& /*reference*/, const SurfaceHit& /*hit*/) const { return 0; }

  // Lights of several parts, such as the triangles of a mesh, can be sampled part by part.
  /// Number of parts that can be sampled separately.
  virtual uint32_t n_parts() const { return 1; }
  /// The part that contains a point on this area light.
  virtual uint32_t part_of(const SurfaceHit& /*hit*/) const { return 0; }
  /// sample_towards() of one part.
  virtual EmitterSample sample_part_towards(uint32_t /*part*/, const Vec3& reference, Vec2 u, float u_primitive) const {
    return sample_towards(reference, u, u_primitive);
  }
  /// Density of sample_part_towards() per unit solid angle at `reference` for the point `hit` on this area light and
  /// the part that contains it.
  virtual float pdf_part_solid_angle(const Vec3& reference, const SurfaceHit& hit) const {
    return pdf_solid_angle(reference, hit);
  }
  /// power() of one part.
  virtual Spectrum part_power(uint32_t /*part*/) const { return power(); }
  /// The surface of an area light, or null.
  virtual const Shape* shape() const { return nullptr; }
  /// Whether an area light emits on both sides of its surface.
  virtual bool emits_on_both_sides() const { return false; }
  /// What sample_towards() samples if that is a parallelogram, so that many samples can be taken at once; otherwise
  /// null.
  virtual const ParallelogramLight* parallelogram() const { return nullptr; }
  /// The same for a sphere.
  virtual const SphereLight* sphere() const { return nullptr; }
  /// Takes sample_towards() of an environment for many points at once, up to rounding. False, and nothing is done, if
  /// this environment cannot.
  virtual bool sample_environment(EnvironmentSamples& /*samples*/) const { return false; }

  /// This environment with the mean subtracted from its density, for use with a technique that covers all directions
  /// [Karlik2019]; null if that is the light itself.
  virtual std::shared_ptr<const Emitter> mis_compensated() const { return nullptr; }

  /// Samples a ray leaving the light, for paths that start there.
  virtual EmissionSample sample_emission(Vec2 u_position, Vec2 u_direction, float u_primitive) const = 0;
  /// Densities of sample_emission() for light leaving in world direction `w` (unit, away from the light) at the point
  /// `hit` on an area light; other lights ignore the point. Deltas are assumed to be matched.
  virtual EmissionPdf pdf_emission(const SurfaceHit& hit, const Vec3& w) const = 0;

  /// Emitted power, integrated over surface and directions, in RGB; for lights at infinity, through the scene's
  /// bounding sphere.
  virtual Spectrum power() const = 0;
  /// False if power() and part_power() only probe some points, e.g. of a texture: what appears black may emit light.
  virtual bool knows_power() const { return true; }

 private:
  std::string group_;
};

}  // namespace covary
