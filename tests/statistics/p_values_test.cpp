// SPDX-License-Identifier: Apache-2.0
// The special functions against tables (Abramowitz & Stegun 1964, tables 26.1, 26.8, 26.10) and identities.
#include "statistics/p_values.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "core/error.h"
#include "core/random.h"

namespace covary::statistics {
namespace {

TEST(PValues, Chi2MatchesClosedForms) {
  for (const double x : {0.01, 0.5, 2.0, 9.0, 40.0, 300.0}) {
    EXPECT_NEAR(chi2_p_value(x, 2), std::exp(-x / 2), 1e-13);                      // two degrees: exponential
    EXPECT_NEAR(chi2_p_value(x, 1), std::erfc(std::sqrt(x / 2)), 1e-13);           // one: squared normal
    EXPECT_NEAR(chi2_p_value(x, 4) / (std::exp(-x / 2) * (1 + x / 2)), 1, 1e-11);  // four: Erlang, tails included
  }
  EXPECT_EQ(chi2_p_value(0, 3), 1);
  EXPECT_EQ(chi2_p_value(std::nan(""), 3), 0);
  EXPECT_NEAR(chi2_p_value(149.449, 100), 0.001, 1e-7);
  EXPECT_NEAR(chi2_p_value(70.0649, 100), 0.99, 1e-6);
}

TEST(PValues, StudentMatchesTables) {
  EXPECT_NEAR(student_t_p_value(1, 1), 0.5, 1e-13);                       // Cauchy
  EXPECT_NEAR(student_t_p_value(-3, 2), 1 - 3 / std::sqrt(11.0), 1e-13);  // closed form for two degrees
  EXPECT_NEAR(student_t_p_value(2.042272, 30), 0.05, 1e-7);
  EXPECT_NEAR(student_t_p_value(2.5, 1e7), normal_p_value(2.5), 5e-8);
}

TEST(PValues, NormalQuantileInvertsTheTail) {
  EXPECT_NEAR(normal_quantile(0.975), 1.959963985, 1e-9);
  EXPECT_NEAR(normal_quantile(1e-6), -4.753424309, 1e-8);
  EXPECT_NEAR(normal_p_value(1.959963985), 0.05, 1e-9);
}

TEST(PValues, BudgetArithmetic) {
  // 200 tests sharing 1e-3: alpha = 5e-6, |z| > 4.56.
  EXPECT_NEAR(sidak(1e-3, 200), 5.0025e-6, 1e-9);
  EXPECT_NEAR(-normal_quantile(sidak(1e-3, 200) / 2), 4.56, 0.01);
  EXPECT_NEAR(1 - std::pow(1 - sidak(1e-3, 37), 37), 1e-3, 1e-12);
  // sigma = mean, alpha = 1e-4, power 0.99: N = 1e4 detects 6.2 %, 1e6 0.62 %.
  EXPECT_NEAR(smallest_detectable(1, 1e4, 1e-4, 0.99), 0.062, 5e-4);
  EXPECT_NEAR(smallest_detectable(1, 1e6, 1e-4, 0.99), 0.0062, 5e-5);
}

TEST(PValues, KolmogorovSmirnovMatchesTheTable) {
  // D = 0.24 at n = 30 has P near 0.0547 (exact: 0.0546); a perfect grid has P = 1.
  std::vector<double> grid;
  for (int i = 0; i < 100; ++i) grid.push_back((i + 0.5) / 100);
  EXPECT_GT(uniform_p_value(grid), 0.999999);
  for (double& v : grid) v *= v;  // not uniform: D = 0.25, p about 5e-6
  EXPECT_LT(uniform_p_value(grid), 1e-4);
}

TEST(PValues, BinomialTailsAreExact) {
  EXPECT_NEAR(binomial_test(0, 10, 0.1).p_value, 2 * std::pow(0.9, 10), 1e-12);
  EXPECT_TRUE(binomial_test(10, 10, 1).accepted);
  EXPECT_FALSE(binomial_test(9, 10, 1).accepted);
  EXPECT_FALSE(binomial_test(1, 10, 0).accepted);
  EXPECT_TRUE(binomial_test(500, 1000, 0.5).accepted);
  EXPECT_FALSE(binomial_test(600, 1000, 0.5).accepted);
}

// N = 300 repetitions, alpha = 1e-6: with power 0.99 the Kolmogorov-Smirnov test detects a deviation of 0.24 in the
// distribution function of the p-values. Planted bug: p-values of a biased mean.
TEST(MeanTests, PValuesAreUniformUnderTheHypothesisAndNotUnderABias) {
  for (const bool biased : {false, true}) {
    std::vector<double> t_values, z_values;
    for (int repetition = 0; repetition < 300; ++repetition) {
      std::vector<double> sample;
      Moments moments;
      for (int i = 0; i < 12; ++i) {  // nearly normal: the sum of twelve uniform numbers, with mean 6 and variance 1
        const PathRandom random(Sampling::kIndependent, 20, repetition, i, 0);
        double sum = biased ? 0.4 : 0;
        for (uint32_t k = 0; k < 12; ++k) sum += random.get_1d(k, Event::kPixel) + 0x1p-25;
        sample.push_back(sum), moments.add(sum);
      }
      t_values.push_back(t_test(sample, 6).p_value);
      z_values.push_back(z_test(moments.mean(), 1.0 / 12, 6).p_value);
    }
    if (biased) {
      EXPECT_LT(uniform_p_value(t_values), 1e-6);
      EXPECT_LT(uniform_p_value(z_values), 1e-6);
    } else {
      EXPECT_GT(uniform_p_value(t_values), 1e-6);
      EXPECT_GT(uniform_p_value(z_values), 1e-6);
    }
  }
}

TEST(MeanTests, RefuseWhatCannotBeTested) {
  EXPECT_FALSE(TestResult{}.accepted);
  EXPECT_EQ(TestResult{}.message, "the test was not run");
  EXPECT_FALSE(z_test(std::nan(""), 1, 0).accepted);
  EXPECT_FALSE(z_test(1.1, 0, 1).accepted);
  EXPECT_TRUE(z_test(1.1, 0, 1, test_alpha(), 0.2).accepted);
  const std::vector<double> three{1, 2, 3};
  try {
    t_test(three, 2);
    FAIL() << "three values were accepted";
  } catch (const Error& e) {
    EXPECT_NE(std::string(e.what()).find("a t-test needs at least 4 values"), std::string::npos) << e.what();
  }
}

}  // namespace
}  // namespace covary::statistics
