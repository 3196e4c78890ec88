// SPDX-License-Identifier: Apache-2.0
// Everything light can meet: shapes, lights, camera; and the queries integrators need.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/transform.h"
#include "scene/camera.h"
#include "scene/emitter.h"
#include "scene/shape.h"
#include "scene/surface_hit.h"

namespace covary {

/// Shapes that are placed several times.
struct ShapeGroup : SceneObject {
  std::vector<ShapePtr> shapes;
};

struct Instance {
  std::shared_ptr<const ShapeGroup> group;
  Transform to_world;
};

/// What a loader hands over.
struct SceneParts {
  std::vector<ShapePtr> shapes;  ///< each with a BSDF and perhaps an area light set
  std::vector<Instance> instances;
  std::vector<std::shared_ptr<const Emitter>> emitters;  ///< in file order, area lights of `shapes` included
  std::shared_ptr<const Camera> camera;
  MediumPtr camera_medium;   ///< in which the camera stands; null: none
  std::string first_medium;  ///< where the file names the first medium that is used; empty: there is none
};

enum class FilterKind { kBox, kTent, kGaussian };
/// Reconstruction filter. Every sample contributes to one pixel only, with weight one: its position inside the filter's
/// footprint is drawn from the filter itself.
struct FilterSettings {
  FilterKind kind = FilterKind::kBox;
  float radius = 0.5f;  ///< in pixels: box 0.5, tent 1, gaussian 4 standard deviations
  float stddev = 0.5f;  ///< gaussian only
};

class RayTracer;

/// What the ray tracer knows of a hit; Scene::resolve makes a SurfaceHit of it.
struct RayHit {
  static constexpr uint32_t kNone = ~0u;
  float t = kInfinity;
  Vec2 barycentric;
  uint32_t primitive = kNone, geometry = kNone, instance = kNone;
  bool found() const { return geometry != kNone; }
};

/// Offset of ray origins against self-intersection, relative to the size of coordinates.
inline constexpr float kRayEpsilon = 1500 * 0x1p-24f;

class Scene {
 public:
  /// Builds the ray tracer's hierarchy.
  explicit Scene(SceneParts parts);
  ~Scene();
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;

  /// Nearest surface along the ray; false when there is none. The same as nearest() and resolve().
  bool intersect(const Ray& ray, SurfaceHit& hit) const;
  /// Nearest hits of many rays. `coherent`: they start at one place and go roughly the same way.
  void nearest(std::span<const Ray> rays, std::span<RayHit> hits, bool coherent) const;
  /// What lies at a hit of `ray` that was found.
  void resolve(const Ray& ray, const RayHit& found, SurfaceHit& hit) const;
  /// Whether anything lies on the ray before t_max.
  bool occluded(const Ray& ray) const;
  /// The same for many rays; 1 where blocked.
  void occluded(std::span<const Ray> rays, std::span<uint8_t> blocked) const;

  const Camera& camera() const { return *parts_.camera; }
  std::span<const std::shared_ptr<const Emitter>> emitters() const { return parts_.emitters; }
  /// The light at infinity that rays leaving the scene meet, or null.
  const Emitter* environment() const { return environment_; }
  bool has_media() const { return !parts_.first_medium.empty(); }
  /// SceneParts::first_medium
  const std::string& first_medium() const { return parts_.first_medium; }
  const Medium* camera_medium() const { return parts_.camera_medium.get(); }
  const Bounds3& bounds() const { return bounds_; }
  /// Distance off a surface at `p` at which rays that leave it begin, against self-intersection.
  float ray_offset(const Vec3& p) const { return (offset_unit_ + max_component(abs(p))) * kRayEpsilon; }
  size_t n_triangles() const { return n_triangles_; }
  size_t n_shapes() const { return parts_.shapes.size(); }
  double build_seconds() const { return build_seconds_; }

 private:
  SceneParts parts_;
  std::unique_ptr<RayTracer> tracer_;
  const Emitter* environment_ = nullptr;
  Bounds3 bounds_;
  float offset_unit_ = 1;  // largest coordinate of the scene, at most 1
  size_t n_triangles_ = 0;
  double build_seconds_ = 0;
};

/// `p`, on a surface of the geometric normal `ng`, moved by `offset` to the side of the surface `w` points to.
inline Vec3 offset_origin(const Vec3& p, const Vec3& ng, float offset, const Vec3& w) {
  return p + ng * std::copysign(offset, dot(ng, w));
}
inline Vec3 offset_origin(const SurfaceHit& hit, const Vec3& w) { return offset_origin(hit.p, hit.ng, hit.offset, w); }

}  // namespace covary
