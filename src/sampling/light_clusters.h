// SPDX-License-Identifier: Apache-2.0
// Clusters of similar lights: near each other, with similar orientation. Bottom-up by the metric of lightcuts
// [Walter2005], by approximate agglomerative clustering along a space-filling curve [Gu2013], in n log n steps.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/ray.h"

namespace covary {

/// A light's description for clustering.
struct ClusterLight {
  Bounds3 bounds;             ///< of its surface; one point for a point light
  Vec3 axis{0, 0, 1};         ///< unit vector around which it emits
  float cos_half_angle = -1;  ///< of the cone of its normals around the axis; -1 if it emits in all directions
  float power = 0;            ///< at least 0
};

struct LightClusters {
  std::vector<uint32_t> cluster_of;  ///< cluster of each light
  uint32_t n_clusters = 0;
};

/// At most `limit` (at least 1) clusters of lights; one per light if there are no more than that. Numbered in the order
/// of their first lights. `scene_diagonal`: length of the diagonal of the scene's bounds, which weights directions
/// against distances. Deterministic.
LightClusters cluster_lights(std::span<const ClusterLight> lights, uint32_t limit, float scene_diagonal);

}  // namespace covary
