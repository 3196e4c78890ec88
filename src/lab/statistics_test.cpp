// SPDX-License-Identifier: Apache-2.0
// Quantiles against tables; intervals and slopes of numbers with known distribution.
#include "lab/statistics.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "core/random.h"
#include "statistics/p_values.h"

namespace covary::lab {
namespace {

double uniform(uint64_t seed, uint64_t index) {
  return PathRandom(Sampling::kIndependent, seed, 0, index, 0).get_1d(0, Event::kPixel);
}
/// Standard normal.
double normal(uint64_t seed, uint64_t index) {
  return statistics::normal_quantile(std::max(1e-9, uniform(seed, index)));
}

TEST(Statistics, QuantilesOfStudent) {
  // [AbramowitzStegun1964] table 26.10.
  EXPECT_NEAR(student_t_quantile(0.975, 1), 12.706, 5e-4);
  EXPECT_NEAR(student_t_quantile(0.975, 2), 4.303, 5e-4);
  EXPECT_NEAR(student_t_quantile(0.975, 9), 2.262, 5e-4);
  EXPECT_NEAR(student_t_quantile(0.995, 10), 3.169, 5e-4);
  EXPECT_NEAR(student_t_quantile(0.025, 30), -2.042, 5e-4);
  for (int dof : {1, 2, 3, 4, 7, 40})
    EXPECT_NEAR(statistics::student_t_p_value(student_t_quantile(0.9, dof), dof), 0.2, 1e-9) << dof;
}

TEST(Statistics, MeanOfFewValues) {
  const Estimate e = mean_estimate(std::array{1.0, 2.0, 6.0});
  EXPECT_DOUBLE_EQ(e.value, 3);
  EXPECT_NEAR(e.standard_error, std::sqrt(14.0 / 2 / 3), 1e-12);
  EXPECT_NEAR(e.high, 3 + 4.3027 * e.standard_error, 1e-3);
  EXPECT_TRUE(std::isnan(mean_estimate(std::array{1.0}).low));
  EXPECT_TRUE(std::isnan(mean_estimate(std::vector<double>{}).value));
}

TEST(Statistics, JackknifeOfAMeanIsItsStandardError) {
  const std::array values{1.0, 2.0, 6.0, 7.5};
  const Estimate e = jackknife(4.125, 4, [&](size_t i) { return (16.5 - values[i]) / 3; });
  EXPECT_NEAR(e.standard_error, mean_estimate(values).standard_error, 1e-12);
}

// N = 2000 experiments of K = 6 pairs a, b with means 6 and 2 that share some of their noise. The interval of the ratio
// must contain 3 in 95 % of them; binomial standard deviation 0.49 %, alpha = 1e-5: within 2.2 %, plus 1 % because the
// logarithm is not exactly normal. An interval that ignored the pairing would cover 99.9 %.
TEST(Statistics, RatioOfPairs) {
  int held = 0;
  for (uint64_t i = 0; i < 2000; ++i) {
    std::array<double, 6> a{}, b{};
    for (uint64_t s = 0; s < 6; ++s) {
      const double common = normal(i, 3 * s);
      a[s] = 6 * (1 + 0.1 * common + 0.03 * normal(i, 3 * s + 1));
      b[s] = 2 * (1 + 0.1 * common + 0.03 * normal(i, 3 * s + 2));
    }
    const Estimate ratio = ratio_of_means(a, b);
    held += ratio.low <= 3 && 3 <= ratio.high;
  }
  EXPECT_NEAR(held / 2000.0, 0.95, 0.032);
  EXPECT_TRUE(std::isnan(ratio_of_means(std::array{1.0, 1.0}, std::array{-1.0, 0.5}).value));
}

TEST(Statistics, GeometricMean) {
  size_t n = 0;
  const std::array ratios{Estimate{2, 0.2, 0, 0}, Estimate{8, 0, 0, 0}, Estimate{}};
  const Estimate mean = geometric_mean(ratios, &n);
  EXPECT_EQ(n, 2u);
  EXPECT_NEAR(mean.value, 4, 1e-12);
  EXPECT_NEAR(mean.standard_error, 4 * 0.1 / 2, 1e-12);
}

TEST(Statistics, WeightedSlope) {
  // The third point is off the line of slope -1 but has almost no weight.
  EXPECT_NEAR(weighted_slope(std::array{0.0, 1.0, 2.0}, std::array{5.0, 4.0, 0.0}, std::array{0.1, 0.1, 1e6}), -1,
              1e-9);
  EXPECT_NEAR(weighted_slope(std::array{0.0, 1.0, 2.0}, std::array{5.0, 4.0, 0.0}, std::array{1.0, 1.0, 1.0}), -2.5,
              1e-12);
}

// N = 500 experiments: errors n^-0.8 with 10 % noise, half of which is common to all budgets of a seed; K = 6 seeds.
// The interval must contain -0.8 in 95 % of them; binomial standard deviation 0.97 %, alpha = 1e-5: within 4.4 %.
TEST(Statistics, SlopeOfConvergence) {
  const std::array samples{48.0, 96.0, 192.0, 384.0};
  int held = 0;
  double mean = 0;
  for (uint64_t i = 0; i < 500; ++i) {
    std::vector<std::vector<double>> errors(4, std::vector<double>(6));
    for (uint64_t s = 0; s < 6; ++s)
      for (size_t b = 0; b < 4; ++b)
        errors[b][s] = std::pow(samples[b], -0.8) * (1 + 0.07 * normal(i, 10 * s) + 0.07 * normal(i, 10 * s + 1 + b));
    const Estimate slope = convergence_slope(samples, errors);
    held += slope.low <= -0.8 && -0.8 <= slope.high;
    mean += slope.value / 500;
  }
  EXPECT_NEAR(held / 500.0, 0.95, 0.044);
  EXPECT_NEAR(mean, -0.8, 0.005);
  EXPECT_TRUE(std::isnan(convergence_slope(std::array{48.0}, {{1, 2}}).value));
}

}  // namespace
}  // namespace covary::lab
