// SPDX-License-Identifier: Apache-2.0
// The error of an image and its bounds. The samples give an estimate R with little bias but much noise
// (image_risk.h); the variance V between halves is stable but blind to bias. Both, and indicators of rare light, are
// features of a model fitted to renders of scenes with known truth (benchmarks/error_intervals):
//
//     log(relMSE / V) = p a . x + s r,   log s = b . x,
//
// r: the standardised residual, with quantiles from scenes left out of the fit; p: 1, but for mixtures 1 - V / v, which
// is 0 if they equal the mean h, whose error is V. No interval is given if few pixels or single groups hold most of the
// noise or light, if the bounds are far apart, or if the image kept fireflies: its error is relative to its own
// brightness, which hides theirs. [Firmino2024] bound the error of each pixel, from estimates of its bias and variance.
#pragma once

#include <array>
#include <string>

#include "estimators/estimator_result.h"

namespace covary {

/// How many of 100 intervals contain the truth.
inline constexpr int kIntervalPercent = 80;
/// A prediction is called reliable if its bounds are within this factor of the middle.
inline constexpr double kReliableFactor = 1.5;

inline constexpr int kErrorFeatures = 9;
using ErrorFeatures = std::array<double, kErrorFeatures>;

/// Features, from the sums of a whole image that has a variance: 1; log(R / V), shrunk towards 0 by noise, and the
/// amount of shrinkage, 0 to 1; logarithms of the noise of h over V, of the noise, of the kurtosis between groups, of
/// the number of pixels that hold the noise, of the fraction of light in the largest group of each pixel, and of the
/// prediction by the standard error over V. R is the error of image_risk.h with 1.27 times its covariance, because a
/// method smooths halves more than the whole (docs/notes/error-estimates.md).
ErrorFeatures error_features(const RiskRow& sums);

/// The distribution of log(relMSE). The upper bound of a mixture of kMinGroups groups or more is at least R.
struct LogError {
  double middle = 0, low = 0, high = 0;
};
/// Denoised means of fewer than kMinGroups groups, such as two renders, have separate fits, because the kurtosis of
/// few groups is uninformative and v is noisier.
LogError fitted_error(const RiskRow& sums, ErrorKind kind);

/// Whether the largest group of each pixel holds most of the light that is not common to all groups: it was found by
/// single paths, whose positions say little about where others will find it.
bool has_rare_light(const RiskRow& sums);

/// Why no interval can be given; empty if one can.
std::string unknown_error(const RiskRow& sums, ErrorKind kind, const LogError& error);

/// The image with the error that its rows tell, if they tell one. The relMSE of the standard error is the middle of the
/// interval (but not of a mean, which is unbiased in every pixel), and the errors of the candidates that it was mixed
/// of are as large relative to it as they were.
EstimatorResult with_error(MethodImage image);

}  // namespace covary
