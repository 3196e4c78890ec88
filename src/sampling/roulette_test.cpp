// SPDX-License-Identifier: Apache-2.0
#include "sampling/roulette.h"

#include <gtest/gtest.h>

#include "statistics/p_values.h"

namespace covary {
namespace {

TEST(Roulette, FollowsTheBrightestChannel) {
  EXPECT_FLOAT_EQ(roulette::survival_probability({0.1f, 0.5f, 0.2f}, 1, Sampling::kIndependent), std::sqrt(0.5f));
  EXPECT_FLOAT_EQ(roulette::survival_probability({0.1f, 0.0625f, 0}, 1, Sampling::kCrn), std::pow(0.1f, 0.25f));
  EXPECT_EQ(roulette::survival_probability({0, 0, 0}, 1, Sampling::kIndependent), 0);
}

TEST(Roulette, AlwaysMayEndAPath) {
  for (const Sampling sampling : {Sampling::kIndependent, Sampling::kCrn})
    EXPECT_FLOAT_EQ(roulette::survival_probability({1, 1, 1e30f}, 1, sampling), 0.95f);
}

TEST(Roulette, RefractionThatScalesRadianceDoesNotCount) {
  // On entering glass of index 1.5, radiance is divided by 1.5 squared; the path carries as much as before.
  const float scale = 1 / (1.5f * 1.5f);
  EXPECT_FLOAT_EQ(roulette::survival_probability(Spectrum(0.6f * scale), 1.5f, Sampling::kIndependent),
                  std::sqrt(0.6f));
}

// Mean of survivor_weight for survivors and 0 for the others, N = 200 000, alpha = 5e-7: detects a bias of 1.6 % of the
// standard deviation with power 0.99. Planted bug: survivors are not reweighted.
TEST(Roulette, KeepsTheMean) {
  for (const float brightness : {0.05f, 0.4f, 0.9f, 5.0f}) {
    const float survival = roulette::survival_probability(Spectrum(brightness), 1, Sampling::kIndependent);
    statistics::Moments right, unweighted;
    for (int i = 0; i < 200000; ++i) {
      const bool survives = PathRandom(Sampling::kIndependent, 5, 0, 0, i).get_1d(1, Event::kRoulette) < survival;
      right.add(survives ? roulette::survivor_weight(survival) : 0);
      unweighted.add(survives ? 1 : 0);
    }
    const auto result = statistics::z_test(right.mean(), right.variance_of_mean(), 1);
    EXPECT_TRUE(result.accepted) << result.message;
    EXPECT_FALSE(statistics::z_test(unweighted.mean(), unweighted.variance_of_mean(), 1).accepted) << brightness;
  }
}

}  // namespace
}  // namespace covary
