// SPDX-License-Identifier: Apache-2.0
// Numbers over seeds with their uncertainty. Intervals hold the true value with probability 0.95 where the numbers that
// go in are independent and not too far from normal; docs/experiments.md says which is which.
#pragma once

#include <cstddef>
#include <functional>
#include <limits>
#include <span>
#include <vector>

namespace covary::lab {

inline constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

/// A value, its standard error and its 95 % interval; not-a-number where there is none.
struct Estimate {
  double value = kNone, standard_error = kNone, low = kNone, high = kNone;
};

/// x with P(T <= x) = p, T of Student's distribution with `dof` >= 1 degrees of freedom, 0 < p < 1.
double student_t_quantile(double p, int dof);

/// Interval of Student's distribution around a value. With dof < 1: the value alone.
Estimate with_interval(double value, double standard_error, int dof);

/// Mean of independent values; no standard error where there is one value only.
Estimate mean_estimate(std::span<const double> values);

/// Jackknife over n independent items: `without(i)` is the statistic without item i.
Estimate jackknife(double value, size_t n, const std::function<double(size_t)>& without);

/// mean(a) / mean(b) of values in pairs, item i of both from the same seed; jackknife of the logarithm. Not-a-number
/// where a mean is not positive.
Estimate ratio_of_means(std::span<const double> a, std::span<const double> b);

/// Geometric mean of independent ratios, each with its own uncertainty: items are fixed, not drawn from a population.
/// Ratios that are not-a-number are left out; `n_used`: how many remained.
Estimate geometric_mean(std::span<const Estimate> ratios, size_t* n_used = nullptr);

/// Slope of a straight line through (x, y) by least squares with weights 1/sigma^2, all sigma > 0; at least two
/// different x.
double weighted_slope(std::span<const double> x, std::span<const double> y, std::span<const double> sigma);

/// Exponent a of error ~ samples^a. `errors[b][s]`: of budget b with seed s, the same seeds for all budgets. Logarithms
/// of the means are fitted with weights by their relative standard errors; jackknife over the seeds, so that samples
/// that budgets have in common do no harm. Not-a-number with fewer than two budgets or seeds or a mean that is not
/// positive.
Estimate convergence_slope(std::span<const double> samples, const std::vector<std::vector<double>>& errors);

}  // namespace covary::lab
