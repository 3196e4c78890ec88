// SPDX-License-Identifier: Apache-2.0
#include "lab/statistics.h"

#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <numeric>

#include "core/error.h"

namespace covary::lab {
namespace {

double mean(std::span<const double> values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

/// Mean of all values but one.
double mean_without(std::span<const double> values, size_t left_out) {
  const double sum = std::accumulate(values.begin(), values.end(), 0.0) - values[left_out];
  return sum / static_cast<double>(values.size() - 1);
}

}  // namespace

double student_t_quantile(double p, int dof) {
  COVARY_CHECK(p > 0 && p < 1 && dof >= 1, "a probability and at least one degree of freedom");
  return boost::math::quantile(boost::math::students_t(dof), p);
}

Estimate with_interval(double value, double standard_error, int dof) {
  if (dof < 1 || !std::isfinite(standard_error)) return {value, kNone, kNone, kNone};
  const double half = student_t_quantile(0.975, dof) * standard_error;
  return {value, standard_error, value - half, value + half};
}

Estimate mean_estimate(std::span<const double> values) {
  if (values.empty()) return {};
  const double n = static_cast<double>(values.size()), m = mean(values);
  double squares = 0;
  for (double v : values) squares += (v - m) * (v - m);
  return with_interval(m, std::sqrt(squares / (n - 1) / n), static_cast<int>(values.size()) - 1);
}

Estimate jackknife(double value, size_t n, const std::function<double(size_t)>& without) {
  if (n < 2) return {value, kNone, kNone, kNone};
  std::vector<double> parts(n);
  for (size_t i = 0; i < n; ++i) parts[i] = without(i);
  const double m = mean(parts);
  double squares = 0;
  for (double part : parts) squares += (part - m) * (part - m);
  return with_interval(value, std::sqrt(squares * static_cast<double>(n - 1) / static_cast<double>(n)),
                       static_cast<int>(n) - 1);
}

Estimate ratio_of_means(std::span<const double> a, std::span<const double> b) {
  COVARY_CHECK(a.size() == b.size(), "values in pairs");
  if (a.empty()) return {};
  const double value = std::log(mean(a) / mean(b));
  if (!std::isfinite(value)) return {};
  const Estimate log_ratio =
      jackknife(value, a.size(), [&](size_t i) { return std::log(mean_without(a, i) / mean_without(b, i)); });
  const double ratio = std::exp(value);
  return {ratio, ratio * log_ratio.standard_error, std::exp(log_ratio.low), std::exp(log_ratio.high)};
}

Estimate geometric_mean(std::span<const Estimate> ratios, size_t* n_used) {
  double log_sum = 0, variance = 0;
  size_t n = 0;
  for (const Estimate& ratio : ratios) {
    if (!(ratio.value > 0) || !std::isfinite(ratio.value)) continue;
    log_sum += std::log(ratio.value);
    const double relative = ratio.standard_error / ratio.value;
    variance += relative * relative;
    ++n;
  }
  if (n_used) *n_used = n;
  if (n == 0) return {};
  const double count = static_cast<double>(n), value = std::exp(log_sum / count);
  const double relative = std::sqrt(variance) / count, factor = std::exp(1.959964 * relative);
  return {value, value * relative, value / factor, value * factor};
}

double weighted_slope(std::span<const double> x, std::span<const double> y, std::span<const double> sigma) {
  COVARY_CHECK(x.size() == y.size() && x.size() == sigma.size(), "as many x as y and sigma");
  double w = 0, wx = 0, wy = 0;
  for (size_t i = 0; i < x.size(); ++i) {
    const double weight = 1 / (sigma[i] * sigma[i]);
    w += weight, wx += weight * x[i], wy += weight * y[i];
  }
  double xx = 0, xy = 0;
  for (size_t i = 0; i < x.size(); ++i) {
    const double weight = 1 / (sigma[i] * sigma[i]), dx = x[i] - wx / w;
    xx += weight * dx * dx;
    xy += weight * dx * (y[i] - wy / w);
  }
  return xy / xx;
}

Estimate convergence_slope(std::span<const double> samples, const std::vector<std::vector<double>>& errors) {
  COVARY_CHECK(samples.size() == errors.size(), "errors for each budget");
  if (errors.size() < 2 || errors[0].size() < 2) return {};
  const size_t n_seeds = errors[0].size();
  std::vector<double> x, y, sigma;
  for (size_t b = 0; b < errors.size(); ++b) {
    COVARY_CHECK(errors[b].size() == n_seeds, "the same seeds for each budget");
    const Estimate error = mean_estimate(errors[b]);
    if (!(error.value > 0)) return {};
    x.push_back(std::log(samples[b]));
    y.push_back(std::log(error.value));
    // Avoids division by zero if the errors of all seeds are equal.
    sigma.push_back(std::max(error.standard_error / error.value, 1e-6));
  }
  const double value = weighted_slope(x, y, sigma);
  if (!std::isfinite(value)) return {};
  return jackknife(value, n_seeds, [&](size_t left_out) {
    std::vector<double> part;
    for (const std::vector<double>& of_budget : errors) part.push_back(std::log(mean_without(of_budget, left_out)));
    return weighted_slope(x, part, sigma);
  });
}

}  // namespace covary::lab
