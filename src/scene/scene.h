// SPDX-License-Identifier: Apache-2.0
// The scene: shapes, lights and camera, and the queries that integrators need.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/colour_matrix.h"
#include "core/keyed_transform.h"
#include "core/rounding.h"
#include "core/transform.h"
#include "scene/camera.h"
#include "scene/emitter.h"
#include "scene/lobed_filter.h"
#include "scene/shape.h"
#include "scene/surface_hit.h"

namespace covary {

/// Shapes that are instanced.
struct ShapeGroup : SceneObject {
  std::vector<ShapePtr> shapes;
};

struct Instance {
  std::shared_ptr<const ShapeGroup> group;
  Transform to_world;
};

/// Animation of a shape or an instance.
struct Movement {
  KeyedTransformPtr to_world;  ///< from its own space to world space
  size_t index = 0;            ///< in SceneParts::shapes, or for an instance, in SceneParts::instances
  /// The shape under a transformation, with its BSDF, media and light; empty: an instance moves. May throw
  /// Error(kInput).
  std::function<ShapePtr(const Transform&)> shape_at;
};

/// The result of a loader. Animated parts are at their positions at time 0.
struct SceneParts {
  std::vector<ShapePtr> shapes;  ///< each with a BSDF and perhaps an area light
  std::vector<Instance> instances;
  std::vector<Movement> movements;
  std::vector<std::shared_ptr<const Emitter>> emitters;  ///< in file order, area lights of `shapes` included
  std::shared_ptr<const Camera> camera;
  /// An environment that only the camera sees, directly or through null surfaces; null: the environment among the
  /// emitters.
  std::shared_ptr<const Emitter> background;
  MediumPtr camera_medium;                    ///< that the camera is in; null: none
  std::optional<ColourMatrix> film_response;  ///< from radiance to the film's values; none: they are the radiance
  bool media_emit = false;                    ///< a medium that is used emits light
  std::string first_medium;  ///< location in the file of the first medium that is used; empty: there is none
};

enum class FilterKind { kBox, kTent, kGaussian, kLobed };
/// Reconstruction filter. Every sample contributes to one pixel only: its position within the filter's footprint is
/// sampled from the filter itself, so that its weight is one, or for kLobed of either sign.
struct FilterSettings {
  FilterKind kind = FilterKind::kBox;
  float radius = 0.5f;                 ///< in pixels: box 0.5, tent 1, gaussian 4 standard deviations
  float stddev = 0.5f;                 ///< gaussian only
  const LobedFilter* lobed = nullptr;  ///< kLobed only
};
inline FilterSettings lobed(const LobedFilter& filter) { return {FilterKind::kLobed, filter.radius(), 0, &filter}; }

class RayTracer;

/// A hit as found by the ray tracer; Scene::resolve turns it into a SurfaceHit.
struct RayHit {
  static constexpr uint32_t kNone = ~0u;
  float t = kInfinity;
  Vec2 barycentric;
  uint32_t primitive = kNone, geometry = kNone, instance = kNone;
  bool found() const { return geometry != kNone; }
};

class Scene {
 public:
  /// Builds the acceleration structure.
  explicit Scene(SceneParts parts);
  ~Scene();
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;

  /// Nearest surface along the ray; false if there is none. Same as nearest() followed by resolve().
  bool intersect(const Ray& ray, SurfaceHit& hit) const;
  /// Nearest hits of many rays. `coherent`: of one origin; of coincident surfaces, the others decide which is hit.
  void nearest(std::span<const Ray> rays, std::span<RayHit> hits, bool coherent) const;
  /// Surface properties at a hit of `ray`, which must exist.
  void resolve(const Ray& ray, const RayHit& found, SurfaceHit& hit) const;
  /// Whether anything is hit along the ray before t_max.
  bool occluded(const Ray& ray) const;
  /// Same for many rays; 1 if occluded.
  void occluded(std::span<const Ray> rays, std::span<uint8_t> blocked) const;

  /// Whether anything except the camera moves.
  bool moves() const { return !parts_.movements.empty(); }
  /// 0 until move_to().
  double time() const { return time_; }
  /// Moves everything to its position at that time; static parts are not rebuilt. Not while the scene is in use. Throws
  /// Error(kInput) if a shape does not support its transformation, such as a sphere with non-uniform scale.
  void move_to(double time);
  /// Motion since another time: for each movement, the map from current positions to positions then.
  std::vector<Transform> displacements(double then) const;
  /// Index in displacements() of the surface that was hit, or -1 if it is static.
  int movement_of(const RayHit& found) const {
    if (movements_.empty()) return -1;
    return movements_[found.instance == RayHit::kNone ? found.geometry : found.instance];
  }

  std::span<const ShapePtr> shapes() const { return parts_.shapes; }
  std::span<const Instance> instances() const { return parts_.instances; }
  const Camera& camera() const { return *parts_.camera; }
  /// Whether on_film() changes values, and may make them negative.
  bool has_film_response() const { return parts_.film_response.has_value(); }
  /// What the film records of this radiance. Integrators compute radiance; passes apply this to their results.
  Spectrum on_film(const Spectrum& radiance) const {
    return parts_.film_response ? *parts_.film_response * radiance : radiance;
  }
  std::span<const std::shared_ptr<const Emitter>> emitters() const { return parts_.emitters; }
  /// The light at infinity that rays leaving the scene hit, or null.
  const Emitter* environment() const { return environment_; }
  /// SceneParts::background
  const Emitter* background() const { return parts_.background.get(); }
  bool has_media() const { return !parts_.first_medium.empty(); }
  /// SceneParts::first_medium
  const std::string& first_medium() const { return parts_.first_medium; }
  const Medium* camera_medium() const { return parts_.camera_medium.get(); }
  const Bounds3& bounds() const { return bounds_; }
  size_t n_triangles() const { return n_triangles_; }
  size_t n_shapes() const { return parts_.shapes.size(); }
  double build_seconds() const { return build_seconds_; }

 private:
  void measure();       // bounds, preparation of lights for sampling
  void place_lights();  // tells them the bounds

  SceneParts parts_;
  std::unique_ptr<RayTracer> tracer_;
  double time_ = 0;
  std::vector<int> movements_;  // of shapes, then of instances: an index into parts_.movements, or -1
  const Emitter* environment_ = nullptr;
  Bounds3 bounds_;
  size_t n_triangles_ = 0;
  double build_seconds_ = 0;
};

/// Origin of a ray that leaves the surface in direction `w`.
inline Vec3 offset_origin(const SurfaceHit& hit, const Vec3& w) { return offset_origin(hit.p, hit.ng, hit.offset, w); }

}  // namespace covary
