// SPDX-License-Identifier: Apache-2.0
#include "lab/statistics.h"

#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <numeric>
#include <set>

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

/// NaN if a mean is not positive.
double log_ratio(std::span<const double> a, std::span<const double> b) {
  return mean(a) > 0 && mean(b) > 0 ? std::log(mean(a) / mean(b)) : kNone;
}
double log_ratio(const Pairs& pairs) { return log_ratio(pairs.a, pairs.b); }

Pairs without(Pairs pairs, uint64_t seed) {
  for (size_t i = pairs.seeds.size(); i-- > 0;)
    if (pairs.seeds[i] == seed) {
      const auto at = static_cast<ptrdiff_t>(i);
      pairs.seeds.erase(pairs.seeds.begin() + at);
      pairs.a.erase(pairs.a.begin() + at);
      pairs.b.erase(pairs.b.begin() + at);
    }
  return pairs;
}

/// Standard error of a statistic from its values without one item each.
double jackknife_error(std::span<const double> parts) {
  const double n = static_cast<double>(parts.size()), m = mean(parts);
  double squares = 0;
  for (const double part : parts) squares += (part - m) * (part - m);
  return std::sqrt(squares * (n - 1) / n);
}

/// With a further independent error, normally distributed.
Estimate widened(const Estimate& estimate, double standard_error) {
  const double half = std::hypot(estimate.high - estimate.value, 1.96 * standard_error);
  return {estimate.value, std::hypot(estimate.standard_error, standard_error), estimate.value - half,
          estimate.value + half};
}

/// From the estimate of a logarithm.
Estimate exponential(const Estimate& log) {
  const double value = std::exp(log.value);
  return {value, value * log.standard_error, std::exp(log.low), std::exp(log.high)};
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
  return with_interval(value, jackknife_error(parts), static_cast<int>(n) - 1);
}

Estimate ratio_of_means(std::span<const double> a, std::span<const double> b) {
  COVARY_CHECK(a.size() == b.size(), "values in pairs");
  Pairs pairs{std::vector<uint64_t>(a.size()), {a.begin(), a.end()}, {b.begin(), b.end()}};
  std::iota(pairs.seeds.begin(), pairs.seeds.end(), 0);
  return geometric_mean_of_ratios({&pairs, 1});
}

Estimate geometric_mean_of_ratios(std::span<const Pairs> items) {
  std::set<uint64_t> seeds;
  size_t fewest = SIZE_MAX;
  double sum = 0, noise = 0;  // noise: variance of the sum
  for (const Pairs& item : items) {
    COVARY_CHECK(item.a.size() == item.seeds.size() && item.b.size() == item.seeds.size(), "values in pairs");
    seeds.insert(item.seeds.begin(), item.seeds.end());
    fewest = std::min(fewest, item.seeds.size());
    sum += log_ratio(item.a, item.b);
    noise += item.noise * item.noise;
  }
  const double n = static_cast<double>(items.size());
  if (items.empty() || !std::isfinite(sum)) return {};
  std::vector<double> parts;
  for (const uint64_t seed : seeds) {
    double part = 0;
    for (const Pairs& item : items) part += log_ratio(without(item, seed));
    parts.push_back(part / n);
  }
  const int dof = fewest < 2 ? 0 : static_cast<int>(fewest) - 1;
  return exponential(widened(with_interval(sum / n, jackknife_error(parts), dof), std::sqrt(noise) / n));
}

double geometric_mean(std::span<const double> values) {
  double sum = 0;
  for (const double value : values) sum += value > 0 ? std::log(value) : kNone;
  return std::exp(sum / static_cast<double>(values.size()));
}

Estimate reciprocal_of_means(std::span<const double> a, std::span<const double> b) {
  COVARY_CHECK(a.size() == b.size(), "values in pairs");
  const double value = 1 / (mean(a) * mean(b));
  if (!(mean(a) > 0) || !(mean(b) > 0)) return {value, kNone, kNone, kNone};
  return exponential(jackknife(std::log(value), a.size(),
                               [&](size_t i) { return -std::log(mean_without(a, i) * mean_without(b, i)); }));
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
