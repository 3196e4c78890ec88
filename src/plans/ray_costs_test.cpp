// SPDX-License-Identifier: Apache-2.0
// Cost of samples, in rays.
#include "passes/ray_costs.h"

#include <gtest/gtest.h>

#include <numeric>

#include "support/plans.h"

namespace covary {
namespace {

/// A box with one open side in front of the background: paths that miss it are one ray long.
TEST(RayCosts, AreHigherWhereThereIsSomething) {
  const LoadedScene scene = load_sized(std::string(COVARY_SOURCE_DIR) + "/scenes/materials.xml", 96, 72);
  const std::shared_ptr<Integrator> integrator = integrator_of(scene).clone();
  integrator->prepare(*scene.scene);
  PassSettings settings;
  settings.seed = 3, settings.pass = 2;
  const Film film(96, 72, {0, 0, 96, 72}, 1);
  const std::vector<double> costs = ray_costs(*scene.scene, *integrator, settings, film, nullptr);
  ASSERT_EQ(costs.size(), 96u * 72u);
  EXPECT_NEAR(std::accumulate(costs.begin(), costs.end(), 0.0) / 6912, 1, 0.1);
  double rays = 0, above = 0;  // of pixels where the cost is at most 1, and above it
  double n_rays = 0, n_above = 0;
  for (int y = 1; y < 72; y += 3)
    for (int x = 1; x < 96; x += 3) {
      const auto n = static_cast<double>(replay_sample(*scene.scene, *integrator, settings, x, y, 1).n_rays);
      const bool is_above = costs[static_cast<size_t>(y) * 96 + x] > 1;
      (is_above ? above : rays) += n, (is_above ? n_above : n_rays) += 1;
    }
  EXPECT_GT(above / n_above, 1.2 * rays / n_rays);
  std::atomic<bool> stop{true};
  for (const double c : ray_costs(*scene.scene, *integrator, settings, film, &stop)) EXPECT_EQ(c, 1);
}

}  // namespace
}  // namespace covary
