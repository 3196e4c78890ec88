// SPDX-License-Identifier: Apache-2.0
// Clusters of lights that are alike: near each other, facing the same way. Bottom-up by the measure of lightcuts
// [Walter2005], by approximate agglomeration over a curve through space [Gu2013], which takes n log n steps.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/ray.h"

namespace covary {

/// A light as clustering sees it.
struct ClusterLight {
  Bounds3 bounds;             ///< of its surface; one point for a point light
  Vec3 axis{0, 0, 1};         ///< unit vector around which it emits
  float cos_half_angle = -1;  ///< of the cone of its normals around the axis; -1 where it emits all around
  float power = 0;            ///< at least 0
};

struct LightClusters {
  std::vector<uint32_t> cluster_of;  ///< for each light
  uint32_t n_clusters = 0;
};

/// At most `limit` (at least 1) clusters of lights; each light alone when there are no more than that. Numbered in the
/// order of their first lights. `scene_diagonal`: length of the diagonal of the scene's bounds, by which directions are
/// weighed against distances. The result depends on nothing but the arguments.
LightClusters cluster_lights(std::span<const ClusterLight> lights, uint32_t limit, float scene_diagonal);

}  // namespace covary
