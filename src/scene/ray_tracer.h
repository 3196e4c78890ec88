// SPDX-License-Identifier: Apache-2.0
// Rays through shapes, by Embree.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "scene/mesh.h"
#include "scene/scene.h"

struct RTCDeviceTy;
struct RTCSceneTy;

namespace covary {

class RayTracer {
 public:
  /// `moves`: whether any of them will move. The hierarchy then has two levels, so that only moved parts and the upper
  /// level are rebuilt.
  RayTracer(std::span<const ShapePtr> shapes, std::span<const Instance> instances, bool moves);
  ~RayTracer();
  RayTracer(const RayTracer&) = delete;
  RayTracer& operator=(const RayTracer&) = delete;

  /// Replaces the shape with this index by another of the same class, with as many primitives.
  void move_shape(size_t index, const Shape& shape);
  void move_instance(size_t index, const Transform& to_world);
  /// Call after moving and before tracing rays.
  void commit();

  void nearest(std::span<const Ray> rays, std::span<RayHit> hits, bool coherent) const;
  void resolve(const Ray& ray, const RayHit& found, SurfaceHit& hit) const;
  void occluded(std::span<const Ray> rays, std::span<uint8_t> blocked) const;

 private:
  struct Group {  // shapes in one Embree scene, indexed by geometry id
    RTCSceneTy* scene = nullptr;
    std::vector<const Shape*> shapes;
    std::vector<const TriangleMesh*> meshes;  // the same; null if not a mesh
  };
  /// The mesh that was hit without an instance transform, or null.
  const TriangleMesh* mesh_of(const RayHit& hit) const {
    return hit.found() && hit.instance == RayHit::kNone ? top_.meshes[hit.geometry] : nullptr;
  }
  struct Placed {
    const Group* group;
    Transform to_world;
    Vec3 slack;  // errors of Embree's transformation of rays to the group's space (core/rounding.h)
  };
  /// `instanced`: for a group that instances place.
  Group make_group(std::span<const ShapePtr> shapes, bool instanced, bool moves) const;
  static Placed placed_at(const Group& group, const Transform& to_world);

  RTCDeviceTy* device_ = nullptr;
  Group top_;  // shapes, then instances
  std::vector<Group> groups_;
  std::vector<Placed> placed_;  // by geometry id in top_ minus top_.shapes.size()
};

}  // namespace covary
