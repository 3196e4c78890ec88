// SPDX-License-Identifier: Apache-2.0
#include "sampling/light_clusters.h"

#include <gtest/gtest.h>

#include <set>

#include "core/error.h"
#include "core/random.h"

namespace covary {
namespace {

ClusterLight light_at(const Vec3& p, const Vec3& axis = {0, 0, -1}, float power = 1) {
  ClusterLight light{{}, axis, 1, power};
  light.bounds.extend(p);
  return light;
}

float number(uint64_t i) { return static_cast<float>(mix64(i) >> 40) * 0x1p-24f; }

std::vector<ClusterLight> random_lights(uint32_t n) {
  std::vector<ClusterLight> lights;
  for (uint32_t i = 0; i < n; ++i)
    lights.push_back(light_at({number(5 * i), number(5 * i + 1), number(5 * i + 2)},
                              normalize(Vec3{number(5 * i + 3) - 0.5f, number(5 * i + 4) - 0.5f, 0.1f})));
  return lights;
}

TEST(LightClusters, EachLightStaysAloneWhereTheLimitAllows) {
  const LightClusters clusters = cluster_lights(random_lights(7), 7, 1);
  EXPECT_EQ(7u, clusters.n_clusters);
  EXPECT_EQ((std::vector<uint32_t>{0, 1, 2, 3, 4, 5, 6}), clusters.cluster_of);
  EXPECT_EQ(0u, cluster_lights({}, 5, 1).n_clusters);
  EXPECT_THROW(cluster_lights({}, 0, 1), Error);
}

/// Three lamps of 50 bulbs each, in mixed order.
TEST(LightClusters, NeighboursComeTogether) {
  std::vector<ClusterLight> lights;
  const Vec3 lamps[] = {{0, 0, 3}, {5, 0, 3}, {2, 6, 3}};
  for (uint32_t i = 0; i < 150; ++i)
    lights.push_back(light_at(lamps[i % 3] + Vec3{number(2 * i), number(2 * i + 1), 0} * 0.2f));
  const LightClusters clusters = cluster_lights(lights, 3, 10);
  EXPECT_EQ(3u, clusters.n_clusters);
  for (uint32_t i = 0; i < 150; ++i) EXPECT_EQ(i % 3, clusters.cluster_of[i]);
}

TEST(LightClusters, LightsOnBothSidesOfAPanelStayApart) {
  std::vector<ClusterLight> lights;
  for (uint32_t i = 0; i < 40; ++i)
    lights.push_back(light_at({number(i), number(i + 100), 0}, {0, 0, i % 2 ? 1.0f : -1.0f}));
  const LightClusters clusters = cluster_lights(lights, 2, 10);
  for (uint32_t i = 0; i < 40; ++i) EXPECT_EQ(i % 2, clusters.cluster_of[i]);
}

/// Powerful lights keep their own clusters longer than weak ones.
TEST(LightClusters, WeakLightsAreMergedFirst) {
  std::vector<ClusterLight> lights;
  for (uint32_t i = 0; i < 20; ++i)
    lights.push_back(light_at({static_cast<float>(i), 0, 0}, {0, 0, 1}, i < 4 ? 10000.0f : 1.0f));
  const LightClusters clusters = cluster_lights(lights, 5, 20);
  std::set<uint32_t> strong;
  for (uint32_t i = 0; i < 4; ++i) strong.insert(clusters.cluster_of[i]);
  EXPECT_EQ(4u, strong.size());
}

TEST(LightClusters, ReachTheLimitAndAreNumberedByTheirFirstLights) {
  for (const uint32_t limit : {1u, 2u, 17u, 999u}) {
    const LightClusters clusters = cluster_lights(random_lights(1000), limit, 1);
    EXPECT_EQ(limit, clusters.n_clusters);
    uint32_t next = 0;
    for (uint32_t cluster : clusters.cluster_of) {
      ASSERT_LE(cluster, next);
      next = std::max(next, cluster + 1);
    }
    EXPECT_EQ(limit, next);
  }
}

/// Mean squared distance to other lights of the cluster: far below that of random clusters.
TEST(LightClusters, ManyLightsGiveTightClusters) {
  const std::vector<ClusterLight> lights = random_lights(4000);
  const auto spread = [&](const std::vector<uint32_t>& cluster_of, uint32_t n) {
    std::vector<Bounds3> bounds(n);
    for (size_t i = 0; i < lights.size(); ++i) bounds[cluster_of[i]].extend(lights[i].bounds);
    double sum = 0;
    for (const Bounds3& b : bounds) sum += static_cast<double>(length_squared(b.upper - b.lower)) / n;
    return sum;
  };
  const LightClusters clusters = cluster_lights(lights, 64, 0);
  // 64 cubes in the unit cube would have 3/16.
  EXPECT_LT(spread(clusters.cluster_of, 64), 0.3);
}

TEST(LightClusters, EqualAndOddLightsAreNoTrouble) {
  std::vector<ClusterLight> lights(100);  // no extent, no power, all directions
  EXPECT_EQ(3u, cluster_lights(lights, 3, 1).n_clusters);
  for (ClusterLight& light : lights) light = light_at({1, 2, 3});
  EXPECT_EQ(3u, cluster_lights(lights, 3, 0).n_clusters);
  lights[5].power = kInfinity;
  lights[6].bounds.extend(Vec3{kInfinity, 0, 0});
  EXPECT_EQ(3u, cluster_lights(lights, 3, 1).n_clusters);
}

}  // namespace
}  // namespace covary
