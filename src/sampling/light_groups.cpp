// SPDX-License-Identifier: Apache-2.0
#include "sampling/light_groups.h"

#include <numeric>

namespace covary {
namespace {

ClusterLight cluster_light(const Light& light, const Bounds3& scene) {
  ClusterLight result;
  result.power = luminance(light.emitter->part_power(light.part));
  if (const Shape* shape = light.emitter->shape()) {
    result.bounds = shape->part_bounds(light.part);
    const Vec3 normal = shape->part_normal(light.part);
    if (length_squared(normal) > 0) result.axis = normal, result.cos_half_angle = 1;
    return result;
  }
  const Vec3 centre = scene.center();
  const EmitterSample sample = light.emitter->sample_towards(centre, {0.5f, 0.5f}, 0.5f);
  if (sample.distance == kInfinity) {
    result.bounds = scene, result.axis = -sample.wi, result.cos_half_angle = 1;
  } else {
    const Vec3 p = centre + sample.wi * sample.distance;
    result.bounds = {p, p};
  }
  return result;
}

}  // namespace

LightClusters cluster_light_set(const LightSet& lights, const Bounds3& scene, uint32_t limit) {
  if (lights.size() > limit) {
    std::vector<ClusterLight> all;
    for (uint32_t i = 0; i < lights.size(); ++i) all.push_back(cluster_light(lights[i], scene));
    return cluster_lights(all, limit, 2 * scene.radius());
  }
  LightClusters each{std::vector<uint32_t>(lights.size()), lights.size()};
  std::iota(each.cluster_of.begin(), each.cluster_of.end(), 0u);
  return each;
}

std::vector<float> expected_samples(const LightClusters& clusters, const LightSet& lights) {
  std::vector<double> counts(clusters.n_clusters);
  for (uint32_t i = 0; i < lights.size(); ++i) counts[clusters.cluster_of[i]] += lights[i].pmf;
  return {counts.begin(), counts.end()};
}

}  // namespace covary
