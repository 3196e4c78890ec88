// SPDX-License-Identifier: Apache-2.0
#include "sampling/mis.h"

#include <gtest/gtest.h>

#include <limits>

namespace covary {
namespace {

constexpr float kDensities[] = {1e-38f, 1e-30f, 1e-20f, 1e-6f, 0.3f, 1, 7, 1e6f, 1e20f, 1e30f, 3e38f};

using Weight = float (*)(float, float);
float unweighted(float, float) { return 1; }
float without_square(float a, float b) { return a / (a + b); }

/// Largest deviation from one of the sum of the two techniques' weights.
float worst_sum(Weight first, Weight second) {
  float worst = 0;
  for (const float a : kDensities)
    for (const float b : kDensities) worst = std::max(worst, std::abs(first(a, b) + second(b, a) - 1));
  return worst;
}

TEST(Mis, WeightsOfBothTechniquesSumToOne) {
  const Weight over_pdf = [](float a, float b) { return mis::power_over_pdf(a, b) * a; };
  EXPECT_LT(worst_sum(mis::balance, mis::balance), 1e-6f);
  EXPECT_LT(worst_sum(mis::power, mis::power), 1e-6f);
  // Planted bugs: no weight, and mixed heuristics.
  EXPECT_GT(worst_sum(mis::power, unweighted), 0.5f);
  EXPECT_GT(worst_sum(mis::power, without_square), 0.1f);
  // Only where 1 / density is within the range of float, so that its product with the density is meaningful.
  for (const float a : kDensities)
    for (const float b : kDensities) {
      if (a < 1e-30f || a > 1e30f) continue;
      EXPECT_NEAR(over_pdf(a, b), mis::power(a, b), 1e-6f) << a << " against " << b;
    }
}

TEST(Mis, Values) {
  EXPECT_FLOAT_EQ(mis::balance(1, 3), 0.25f);
  EXPECT_FLOAT_EQ(mis::power(1, 3), 0.1f);
  EXPECT_FLOAT_EQ(mis::power_over_pdf(2, 6), 0.05f);
}

TEST(Mis, OneTechniqueAloneHasFullWeight) {
  for (const float a : kDensities) {
    EXPECT_EQ(mis::balance(a, 0), 1);
    EXPECT_EQ(mis::power(a, 0), 1);
    EXPECT_FLOAT_EQ(mis::power_over_pdf(a, 0), 1 / a);
  }
}

TEST(Mis, HugeAndInfiniteDensitiesOfTheOtherGiveTheLimit) {
  for (const float a : {1e-30f, 1.0f, 1e10f}) {
    EXPECT_EQ(mis::power(a, std::numeric_limits<float>::infinity()), 0);
    EXPECT_EQ(mis::balance(a, std::numeric_limits<float>::infinity()), 0);
    EXPECT_EQ(mis::power_over_pdf(a, std::numeric_limits<float>::infinity()), 0);
    EXPECT_EQ(mis::power(a, 3e38f), 0);
  }
}

}  // namespace
}  // namespace covary
