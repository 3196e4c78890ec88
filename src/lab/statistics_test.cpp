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
  EXPECT_NEAR(geometric_mean(std::array{2.0, 8.0}), 4, 1e-12);
  EXPECT_TRUE(std::isnan(geometric_mean(std::array{2.0, kNone})));
  EXPECT_TRUE(std::isnan(geometric_mean(std::vector<double>{})));
}

// The mean of one ratio is that ratio, with the same interval: Student's factor for one degree of freedom is 12.706.
TEST(Statistics, GeometricMeanOfOneRatio) {
  const Pairs pairs{{1, 2}, {3, 5}, {1, 1.5}};
  const Estimate one = ratio_of_means(pairs.a, pairs.b), mean = geometric_mean_of_ratios({&pairs, 1});
  EXPECT_EQ(mean.value, one.value);
  EXPECT_EQ(mean.low, one.low);
  EXPECT_EQ(mean.high, one.high);
  EXPECT_NEAR(std::log(one.high / one.value), 12.706 * one.standard_error / one.value, 1e-4);
  // Ratios 2 and 8 of two items, equal for all seeds but one that one item lacks.
  const std::array items{Pairs{{1, 2, 3}, {2, 2, 2}, {1, 1, 1}}, Pairs{{1, 3}, {8, 8}, {1, 1}}};
  const Estimate exact = geometric_mean_of_ratios(items);
  EXPECT_NEAR(exact.value, 4, 1e-12);
  EXPECT_NEAR(exact.high, 4, 1e-12);
  EXPECT_TRUE(std::isnan(geometric_mean_of_ratios(std::array{items[0], Pairs{{1}, {8}, {1}}}).low)) << "one seed";
  EXPECT_TRUE(std::isnan(geometric_mean_of_ratios(std::array{items[0], Pairs{{1, 2}, {8, -9}, {1, 1}}}).value));
}

/// Noise of the references, of which the seeds tell nothing.
TEST(Statistics, RatiosAreWidenedByNoiseOfAllSeeds) {
  Pairs pairs{{1, 2, 3}, {8, 8, 8}, {1, 1, 1}, 0.5};
  const Estimate one = geometric_mean_of_ratios({&pairs, 1});
  EXPECT_NEAR(one.value, 8, 1e-12);
  EXPECT_NEAR(one.standard_error, 4, 1e-12);
  EXPECT_NEAR(one.high, 8 * std::exp(0.98), 1e-9);
  EXPECT_NEAR(one.low, 8 * std::exp(-0.98), 1e-9);
  EXPECT_NEAR(geometric_mean_of_ratios(std::array{pairs, pairs}).high, 8 * std::exp(0.98 / std::sqrt(2.0)), 1e-9);
  pairs.b = {1, 1.1, 0.9};
  const Estimate seeds = geometric_mean_of_ratios(std::array{Pairs{pairs.seeds, pairs.a, pairs.b}});
  const Estimate both = geometric_mean_of_ratios({&pairs, 1});
  EXPECT_NEAR(std::log(both.high / both.value), std::hypot(std::log(seeds.high / seeds.value), 0.98), 1e-9);
}

// Errors of K seeds in four scenes, with a relative noise of 5, 10, 20 and 30 %, half of whose variance all scenes have
// in common, as from common random numbers. N = 4000 experiments; binomial standard deviation 0.34 %, alpha = 1e-5:
// 1.5 %, and 1 % because logarithms of means of so noisy values are not exactly normal. With 1.96 in place of Student's
// factor, 82 % would hold for three seeds, 88 % for five.
TEST(Statistics, IntervalsOfMeansHoldForFewSeeds) {
  const std::array<double, 4> noise{0.05, 0.1, 0.2, 0.3};
  for (const uint64_t n_seeds : {3, 5, 10}) {
    int mean_held = 0, ratio_held = 0, geometric_held = 0, reciprocal_held = 0;
    for (uint64_t i = 0; i < 4000; ++i) {
      const auto draw = [&](uint64_t s, uint64_t k) { return normal(7919 * n_seeds + i, 16 * s + k); };
      std::array<Pairs, 4> scenes;
      for (uint64_t s = 0; s < n_seeds; ++s)
        for (size_t k = 0; k < 4; ++k) {
          scenes[k].seeds.push_back(s);
          scenes[k].a.push_back((2.0 + static_cast<double>(k)) *
                                (1 + noise[k] * (draw(s, 0) + draw(s, 1 + k)) / std::sqrt(2.0)));
          scenes[k].b.push_back(1 + 0.05 * draw(s, 5 + k));
        }
      const auto holds = [](const Estimate& e, double truth) { return e.low <= truth && truth <= e.high; };
      mean_held += holds(mean_estimate(scenes[1].a), 3);
      ratio_held += holds(ratio_of_means(scenes[1].a, scenes[1].b), 3);
      geometric_held += holds(geometric_mean_of_ratios(scenes), std::pow(2.0 * 3 * 4 * 5, 0.25));
      reciprocal_held += holds(reciprocal_of_means(scenes[1].a, scenes[1].b), 1 / 3.0);
    }
    EXPECT_NEAR(mean_held / 4000.0, 0.95, 0.015) << n_seeds;
    EXPECT_NEAR(ratio_held / 4000.0, 0.95, 0.025) << n_seeds;
    EXPECT_NEAR(geometric_held / 4000.0, 0.95, 0.025) << n_seeds;
    EXPECT_NEAR(reciprocal_held / 4000.0, 0.95, 0.025) << n_seeds;
  }
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
