// SPDX-License-Identifier: Apache-2.0
// Statistics over seeds with their uncertainty. Intervals contain the true value with probability 0.95 if the inputs
// are independent and approximately normal; docs/experiments.md says which are.
#pragma once

#include <cstddef>
#include <cstdint>
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

/// Values of two methods in pairs, pair i of both from seeds[i]. No seed occurs twice.
struct Pairs {
  std::vector<uint64_t> seeds;
  std::vector<double> a, b;
  double noise = 0;  ///< further standard error of log(mean(a) / mean(b)), alike for all seeds
};

/// mean(a) / mean(b); jackknife of the logarithm. NaN if a mean is not positive.
Estimate ratio_of_means(std::span<const double> a, std::span<const double> b);

/// Geometric mean over `items` of mean(a) / mean(b); jackknife of the logarithm over the seeds, each of which is left
/// out of all items at once, because what it draws may have the same effect on all of them. The items are fixed, not
/// drawn from a population. Student's t has as many degrees of freedom as the item with the fewest seeds; noise of the
/// items, independent of the seeds and of one another, widens the interval. NaN if a mean is not positive, or without
/// items.
Estimate geometric_mean_of_ratios(std::span<const Pairs> items);

/// NaN without values or if one is not positive.
double geometric_mean(std::span<const double> values);

/// 1 / (mean(a) mean(b)) of values in pairs; jackknife of the logarithm. No interval if a mean is not positive.
Estimate reciprocal_of_means(std::span<const double> a, std::span<const double> b);

/// Slope of a least-squares line through (x, y) with weights 1/sigma^2, all sigma > 0; needs two different x.
double weighted_slope(std::span<const double> x, std::span<const double> y, std::span<const double> sigma);

/// Exponent a of error ~ samples^a. `errors[b][s]`: budget b, seed s, with the same seeds for all budgets. Fits
/// logarithms of the means, weighted by their relative standard errors; jackknife over the seeds, so that samples
/// shared by budgets do no harm. NaN with fewer than two budgets or seeds, or if a mean is not positive.
Estimate convergence_slope(std::span<const double> samples, const std::vector<std::vector<double>>& errors);

}  // namespace covary::lab
