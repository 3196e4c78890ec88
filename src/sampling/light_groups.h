// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "sampling/light_clusters.h"
#include "sampling/light_set.h"

namespace covary {

/// Clusters of the lights of a set, at most `limit` (at least 1); see cluster_lights(). `scene`: its bounds.
LightClusters cluster_light_set(const LightSet& lights, const Bounds3& scene, uint32_t limit);

/// The expected number of samples that a vertex takes of each cluster, which takes one of the whole set.
std::vector<float> expected_samples(const LightClusters& clusters, const LightSet& lights);

}  // namespace covary
