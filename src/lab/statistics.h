// SPDX-License-Identifier: Apache-2.0
// Statistics over seeds with their uncertainty. Intervals contain the true value with probability 0.95 if the inputs
// are independent and approximately normal; docs/experiments.md says which are.
#pragma once

#include <cstddef>
#include <functional>
#include <limits>
#include <span>
#include <vector>

namespace covary::lab {

inline constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

/// A value, its standard error and its 95 % interval; NaN for unknown members.
struct Estimate {
  double value = kNone, standard_error = kNone, low = kNone, high = kNone;
};

/// x with P(T <= x) = p, T of Student's distribution with `dof` >= 1 degrees of freedom, 0 < p < 1.
double student_t_quantile(double p, int dof);

/// Interval from Student's distribution around a value. With dof < 1: the value alone.
Estimate with_interval(double value, double standard_error, int dof);

/// Mean of independent values; no standard error if there is only one.
Estimate mean_estimate(std::span<const double> values);

/// Jackknife over n independent items: `without(i)` is the statistic without item i.
Estimate jackknife(double value, size_t n, const std::function<double(size_t)>& without);

/// mean(a) / mean(b) of paired values, item i of both from the same seed; jackknife of the logarithm. NaN if a mean is
/// not positive.
Estimate ratio_of_means(std::span<const double> a, std::span<const double> b);

/// Geometric mean of independent ratios, each with its own uncertainty: items are fixed, not drawn from a population.
/// NaN ratios are left out; `n_used`: how many remained.
Estimate geometric_mean(std::span<const Estimate> ratios, size_t* n_used = nullptr);

/// Slope of a least-squares line through (x, y) with weights 1/sigma^2, all sigma > 0; needs two different x.
double weighted_slope(std::span<const double> x, std::span<const double> y, std::span<const double> sigma);

/// Exponent a of error ~ samples^a. `errors[b][s]`: budget b, seed s, with the same seeds for all budgets. Fits
/// logarithms of the means, weighted by their relative standard errors; jackknife over the seeds, so that samples
/// shared by budgets do no harm. NaN with fewer than two budgets or seeds, or if a mean is not positive.
Estimate convergence_slope(std::span<const double> samples, const std::vector<std::vector<double>>& errors);

}  // namespace covary::lab
