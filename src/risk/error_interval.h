// SPDX-License-Identifier: Apache-2.0
// How wrong an image is, and between which bounds (ours). What its samples tell (image_risk.h) is an estimate R with
// little bias and much noise; the variance V between halves is steady but knows no bias. Both, and what speaks for rare
// light, are features of a fit to renders of scenes whose truth is known (benchmarks/error_intervals):
//
//     log(relMSE / V) = p a . x + s r,   log s = b . x,
//
// r: what the fit leaves open, whose quantiles are those of scenes that it did not see; p: 1, of mixtures 1 - V / v,
// 0 where they are the mean h, whose error is V. Where few pixels or single groups hold the noise or the light, or the
// bounds are far from each other, no interval is given.
#pragma once

#include <array>
#include <string>

#include "estimators/estimator_result.h"

namespace covary {

/// How many of 100 intervals hold the truth.
inline constexpr int kIntervalPercent = 80;
/// Nothing is called reliable whose bounds are further from the middle than this factor.
inline constexpr double kReliableFactor = 1.5;

inline constexpr int kErrorFeatures = 9;
using ErrorFeatures = std::array<double, kErrorFeatures>;

/// Of the sums of a whole image that has a variance: 1; log(R / V), where noise hides it towards 0, and how much it is
/// hidden, 0 to 1; logs of the noise of h over V, of the noise, of the kurtosis between groups, of how many pixels hold
/// the noise, of the share of light that the largest group of each pixel has, and of the prediction by the standard
/// error over V. R is the error of image_risk.h with 1.27 times its covariance: halves are smoothed more than the
/// whole, and groups that are left out tell so much more.
ErrorFeatures error_features(const RiskRow& sums);

/// What is known of log(relMSE).
struct LogError {
  double middle = 0, low = 0, high = 0;
};
/// Denoised means of fewer than kFewestGroups groups, such as two renders, have fits of their own: the kurtosis of few
/// groups tells little, and v is noisier.
LogError fitted_error(const RiskRow& sums, ErrorKind kind);

/// Why no interval can be given; empty where one can.
std::string unknown_error(const RiskRow& sums, ErrorKind kind, const LogError& error);

/// Scales the standard error of `result` so that its relMSE is the middle of the interval (that of a mean stays as it
/// is, unbiased in every pixel), and sets `result.interval` and `result.risk_sums`. Empties `result.risk_rows`; does
/// nothing where there are none.
void apply_interval(EstimatorResult& result);

}  // namespace covary
