// SPDX-License-Identifier: Apache-2.0
// The arithmetic of statistical tests: tail probabilities, quantiles, the share of the suite's false-positive budget
// that one test gets, and the smallest error a test can see. Every statistical test states N, alpha, the smallest error
// it detects and the power at which it does; these functions compute them.
#pragma once

#include <span>
#include <string>

namespace covary::statistics {

/// Probability that the whole suite reports a false error, spread over all statistical tests.
inline constexpr double kSuiteAlpha = 1e-3;
/// Number of statistical tests the budget is spread over (an upper bound; more tests need a larger number here).
inline constexpr int kSuiteTests = 2000;

/// alpha of one of `n_tests` tests that together err with probability `suite_alpha` (Sidak).
double sidak(double suite_alpha, int n_tests);
/// The alpha every single comparison uses unless it says otherwise: 5e-7, |z| > 5.03.
double test_alpha();

/// Probability of a chi-square statistic at least this large; 0 where the statistic is not a number.
double chi2_p_value(double statistic, double dof);
/// Two-sided.
double normal_p_value(double z);
double student_t_p_value(double t, double dof);
/// P(Z <= z) = p.
double normal_quantile(double p);
/// Smallest bias of a mean of n independent values of standard deviation `sigma` that a two-sided test at `alpha`
/// rejects with probability `power`: (z_{1-alpha/2} + z_power) sigma / sqrt(n).
double smallest_detectable(double sigma, double n, double alpha, double power);
/// Kolmogorov-Smirnov test that `values` come from the uniform distribution on [0, 1].
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

/// Is the mean of a distribution `expected`, given an estimate whose variance is known (or estimated from very many
/// values)? `slack` is a known numerical error of `expected`, absolute.
TestResult z_test(double estimate, double variance_of_mean, double expected, double alpha = test_alpha(),
                  double slack = 0);
/// The same from independent values of unknown variance (Student). Throws Error(kInternal) with fewer than 4 values.
TestResult t_test(std::span<const double> values, double expected, double alpha = test_alpha());
/// Is the number of successes of n trials compatible with `probability`? Exact where the outcome is certain.
TestResult binomial_test(double successes, double n, double probability, double alpha = test_alpha());

}  // namespace covary::statistics
