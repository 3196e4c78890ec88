// SPDX-License-Identifier: Apache-2.0
// The one place that knows Embree, version 3 or 4.
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
  /// `moves`: some of them will be moved. Their hierarchy then has two levels, so that only what moved and the upper
  /// level are built again.
  RayTracer(std::span<const ShapePtr> shapes, std::span<const Instance> instances, bool moves);
  ~RayTracer();
  RayTracer(const RayTracer&) = delete;
  RayTracer& operator=(const RayTracer&) = delete;

  /// Puts another shape in place of the one of that index: one of the same class, with as many primitives.
  void move_shape(size_t index, const Shape& shape);
  void move_instance(size_t index, const Transform& to_world);
  /// After moving, before the next ray.
  void commit();

  void nearest(std::span<const Ray> rays, std::span<RayHit> hits, bool coherent) const;
  void resolve(const Ray& ray, const RayHit& found, SurfaceHit& hit) const;
  void occluded(std::span<const Ray> rays, std::span<uint8_t> blocked) const;

 private:
  struct Group {  // shapes of one Embree scene, indexed by geometry id
    RTCSceneTy* scene = nullptr;
    std::vector<const Shape*> shapes;
    std::vector<const TriangleMesh*> meshes;  // the same; null where it is no mesh
  };
  /// The mesh that was hit in the world's own space, or null.
  const TriangleMesh* mesh_of(const RayHit& hit) const {
    return hit.found() && hit.instance == RayHit::kNone ? top_.meshes[hit.geometry] : nullptr;
  }
  Group make_group(std::span<const ShapePtr> shapes, bool moves = false) const;

  RTCDeviceTy* device_ = nullptr;
  Group top_;  // shapes, then instances
  std::vector<Group> groups_;
  struct Placed {
    const Group* group;
    Transform to_world;
  };
  std::vector<Placed> placed_;  // by geometry id in top_ minus top_.shapes.size()
};

}  // namespace covary
