// SPDX-License-Identifier: Apache-2.0
// The arithmetic of statistical tests: tail probabilities, quantiles, one test's fraction of the suite's false-positive
// budget, and the smallest error that a test detects. Every statistical test states N, alpha, the smallest error that
// it detects and with what power; these functions compute them.
#pragma once

#include <span>
#include <string>

namespace covary::statistics {

/// Probability of a false positive in the whole suite, spread over all statistical tests.
inline constexpr double kSuiteAlpha = 1e-3;
/// Upper bound on the number of statistical tests that share the budget; raise it if there are more.
inline constexpr int kSuiteTests = 2000;

/// alpha of each of `n_tests` tests with a joint false-positive probability of `suite_alpha` (Sidak).
double sidak(double suite_alpha, int n_tests);
/// The alpha of a single comparison unless it says otherwise: 5e-7, |z| > 5.03.
double test_alpha();

/// Probability of a chi-square statistic at least this large; 0 if the statistic is NaN.
double chi2_p_value(double statistic, double dof);
/// Two-sided.
double normal_p_value(double z);
double student_t_p_value(double t, double dof);
/// The z with P(Z <= z) = p.
double normal_quantile(double p);
/// Smallest bias of a mean of n independent values with standard deviation `sigma` that a two-sided test at `alpha`
/// rejects with probability `power`: (z_{1-alpha/2} + z_power) sigma / sqrt(n).
double smallest_detectable(double sigma, double n, double alpha, double power);
/// p-value of the Kolmogorov-Smirnov test that `values` are uniform on [0, 1].
double uniform_p_value(std::span<const double> values);

/// Running mean and variance (Welford 1962).
class Moments {
 public:
  void add(double x) {
    ++n_;
    const double d = x - mean_;
    mean_ += d / n_;
    m2_ += d * (x - mean_);
  }
  double n() const { return n_; }
  double mean() const { return mean_; }
  double sample_variance() const { return n_ > 1 ? m2_ / (n_ - 1) : 0; }
  double variance_of_mean() const { return sample_variance() / n_; }

 private:
  double n_ = 0, mean_ = 0, m2_ = 0;
};

struct TestResult {
  bool accepted = false;
  double p_value = 0;
  std::string message = "the test was not run";
};

/// Tests whether the mean of a distribution is `expected`, from an estimate whose variance is known (or estimated from
/// very many values). `slack` is the known absolute numerical error of `expected`.
TestResult z_test(double estimate, double variance_of_mean, double expected, double alpha = test_alpha(),
                  double slack = 0);
/// Student's t-test of the same from independent values. Throws Error(kInternal) with fewer than 4 values.
TestResult t_test(std::span<const double> values, double expected, double alpha = test_alpha());
/// Two-sided binomial test of the number of successes in n trials against `probability`; exact tails, doubled.
TestResult binomial_test(double successes, double n, double probability, double alpha = test_alpha());

}  // namespace covary::statistics
