// SPDX-License-Identifier: Apache-2.0
#include "statistics/p_values.h"

#include <fmt/format.h>

#include <algorithm>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <boost/math/special_functions/beta.hpp>
#include <boost/math/special_functions/gamma.hpp>
#include <cmath>
#include <vector>

#include "core/error.h"

namespace covary::statistics {

double sidak(double suite_alpha, int n_tests) { return -std::expm1(std::log1p(-suite_alpha) / n_tests); }

double test_alpha() { return sidak(kSuiteAlpha, kSuiteTests); }

double chi2_p_value(double statistic, double dof) {
  if (std::isnan(statistic)) return 0;
  return statistic > 0 ? boost::math::gamma_q(dof / 2, statistic / 2) : 1;
}

double normal_p_value(double z) { return std::erfc(std::abs(z) / std::sqrt(2.0)); }

double student_t_p_value(double t, double dof) {
  return 2 * boost::math::cdf(boost::math::complement(boost::math::students_t(dof), std::abs(t)));
}

double normal_quantile(double p) { return boost::math::quantile(boost::math::normal(), p); }

double smallest_detectable(double sigma, double n, double alpha, double power) {
  return (-normal_quantile(alpha / 2) + normal_quantile(power)) * sigma / std::sqrt(n);
}

double uniform_p_value(std::span<const double> values) {
  std::vector<double> sorted(values.begin(), values.end());
  std::sort(sorted.begin(), sorted.end());
  const double n = static_cast<double>(sorted.size());
  double d = 0;
  for (size_t i = 0; i < sorted.size(); ++i) d = std::max({d, sorted[i] - i / n, (i + 1) / n - sorted[i]});
  // Kolmogorov's distribution (in Boost.Math since 1.75) with Stephens' correction for finite n (Stephens 1970,
  // Table 1).
  const double x = d * (std::sqrt(n) + 0.12 + 0.11 / std::sqrt(n));
  if (x < 0.2) return 1;
  double sum = 0;
  for (int k = 1; k < 100; ++k) sum += (k % 2 ? 2 : -2) * std::exp(-2.0 * k * k * x * x);
  return std::clamp(sum, 0.0, 1.0);
}

TestResult z_test(double estimate, double variance_of_mean, double expected, double alpha, double slack) {
  TestResult result;
  const double sigma = std::sqrt(variance_of_mean);
  const double distance = std::max(0.0, std::abs(estimate - expected) - slack);
  result.p_value = distance == 0 ? 1 : sigma > 0 ? normal_p_value(distance / sigma) : 0;
  result.accepted = std::isfinite(estimate) && result.p_value >= alpha;
  result.message = fmt::format("estimate {:.8g} +- {:.3g}, expected {:.8g}: p = {:.3g}, alpha = {:.3g}", estimate,
                               sigma, expected, result.p_value, alpha);
  return result;
}

TestResult t_test(std::span<const double> values, double expected, double alpha) {
  COVARY_CHECK(values.size() >= 4, "a t-test needs at least 4 values");
  Moments moments;
  for (const double v : values) moments.add(v);
  const double sigma = std::sqrt(moments.variance_of_mean()), distance = std::abs(moments.mean() - expected);
  TestResult result;
  result.p_value = distance == 0 ? 1 : sigma > 0 ? student_t_p_value(distance / sigma, moments.n() - 1) : 0;
  result.accepted = std::isfinite(moments.mean()) && result.p_value >= alpha;
  result.message = fmt::format("mean {:.8g} +- {:.3g} of {} values, expected {:.8g}: p = {:.3g}, alpha = {:.3g}",
                               moments.mean(), sigma, values.size(), expected, result.p_value, alpha);
  return result;
}

TestResult binomial_test(double successes, double n, double probability, double alpha) {
  TestResult result;
  const double p = std::clamp(probability, 0.0, 1.0);
  // Tail P(X >= s) or P(X <= s) as incomplete beta functions (DLMF 8.17.5), doubled.
  const double upper = successes > 0 ? boost::math::ibeta(successes, n - successes + 1, p) : 1;
  const double lower = successes < n ? boost::math::ibetac(successes + 1, n - successes, p) : 1;
  result.p_value = std::min(1.0, 2 * std::min(upper, lower));
  result.accepted = result.p_value >= alpha;
  result.message = fmt::format("{} of {} trials, probability {:.6g}: p = {:.3g}, alpha = {:.3g}", successes, n,
                               probability, result.p_value, alpha);
  return result;
}

}  // namespace covary::statistics
