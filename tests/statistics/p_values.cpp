// SPDX-License-Identifier: Apache-2.0
#include "statistics/p_values.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/error.h"

namespace covary::statistics {

double sidak(double suite_alpha, int n_tests) { return -std::expm1(std::log1p(-suite_alpha) / n_tests); }

double test_alpha() { return sidak(kSuiteAlpha, kSuiteTests); }

double gamma_q(double a, double x) {
  if (!(x > 0)) return 1;
  const double scale = std::exp(a * std::log(x) - x - std::lgamma(a));
  if (x < a + 1) {  // series of the lower function
    double term = 1 / a, sum = term;
    for (double n = a + 1; term > sum * 1e-16; ++n) sum += term *= x / n;
    return 1 - sum * scale;
  }
  // Continued fraction of the upper function by Lentz's method (DLMF 8.9.2).
  double b = x + 1 - a, c = 1e300, d = 1 / b, h = d;
  for (int i = 1; i < 100000; ++i) {
    const double an = -i * (i - a);
    b += 2;
    d = 1 / (an * d + b), c = b + an / c;
    h *= c * d;
    if (std::abs(c * d - 1) < 1e-15) break;
  }
  return scale * h;
}

double beta_inc(double a, double b, double x) {
  if (!(x > 0)) return 0;
  if (!(x < 1)) return 1;
  if (x > (a + 1) / (a + b + 2)) return 1 - beta_inc(b, a, 1 - x);
  const double scale =
      std::exp(std::lgamma(a + b) - std::lgamma(a) - std::lgamma(b) + a * std::log(x) + b * std::log1p(-x)) / a;
  // Continued fraction (DLMF 8.17.22) by Lentz's method.
  double c = 1, d = 1 / (1 - (a + b) * x / (a + 1)), h = d;
  for (int m = 1; m < 100000; ++m) {
    const double even = m * (b - m) * x / ((a + 2 * m - 1) * (a + 2 * m));
    d = 1 / (1 + even * d), c = 1 + even / c;
    h *= c * d;
    const double odd = -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1));
    d = 1 / (1 + odd * d), c = 1 + odd / c;
    h *= c * d;
    if (std::abs(c * d - 1) < 1e-15) break;
  }
  return scale * h;
}

double chi2_p_value(double statistic, double dof) { return gamma_q(dof / 2, statistic / 2); }

double normal_p_value(double z) { return std::erfc(std::abs(z) / std::sqrt(2.0)); }

double student_t_p_value(double t, double dof) { return beta_inc(dof / 2, 0.5, dof / (dof + t * t)); }

double normal_quantile(double p) {
  double low = -40, high = 40;  // bisection: tests do not need it fast
  for (int i = 0; i < 200; ++i) {
    const double z = (low + high) / 2;
    (std::erfc(-z / std::sqrt(2.0)) / 2 < p ? low : high) = z;
  }
  return low;
}

double smallest_detectable(double sigma, double n, double alpha, double power) {
  return (-normal_quantile(alpha / 2) + normal_quantile(power)) * sigma / std::sqrt(n);
}

double uniform_p_value(std::span<const double> values) {
  std::vector<double> sorted(values.begin(), values.end());
  std::sort(sorted.begin(), sorted.end());
  const double n = static_cast<double>(sorted.size());
  double d = 0;
  for (size_t i = 0; i < sorted.size(); ++i) d = std::max({d, sorted[i] - i / n, (i + 1) / n - sorted[i]});
  // Kolmogorov's distribution with Stephens' correction for finite n (Stephens 1970, Table 1).
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
  const double upper = successes > 0 ? beta_inc(successes, n - successes + 1, p) : 1;
  const double lower = successes < n ? 1 - beta_inc(successes + 1, n - successes, p) : 1;
  result.p_value = std::min(1.0, 2 * std::min(upper, lower));
  result.accepted = result.p_value >= alpha;
  result.message = fmt::format("{} of {} trials, probability {:.6g}: p = {:.3g}, alpha = {:.3g}", successes, n,
                               probability, result.p_value, alpha);
  return result;
}

}  // namespace covary::statistics
