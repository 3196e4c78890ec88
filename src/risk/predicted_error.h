// SPDX-License-Identifier: Apache-2.0
// The error of the whole image predicted by an estimator's own error estimate.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "estimators/estimator_result.h"
#include "film/grouped_image.h"

namespace covary {

/// relMSE predicted by the standard errors of `result`, with the estimate in place of the reference:
///     1 / (3N) sum ||StdError||^2 / (F'^2 + 0.01),   F': mean of the pixel's three values.
/// Ignores non-finite pixels. Throws Error(kUsage) if `result` has no standard error.
double predicted_relmse(const EstimatorResult& result);

/// Same per block of 16 x 16 pixels (smaller at the right and lower edges): the 95 % quantile over blocks, which
/// describes the worst regions.
double predicted_blocks(const EstimatorResult& result);

/// A pixel is a firefly if it is so many times as bright as those around it, and its standard error is more than
/// 1 / kKnownBrightness of its brightness.
inline constexpr double kFireflyFactor = 10, kKnownBrightness = 4;

/// What predicted_relmse() hides: the error of fireflies relative to the brightness around them.
struct Fireflies {
  size_t pixels = 0;
  double relmse = 0;  ///< sum over these pixels, divided by the number of all pixels
};
/// The brightness around a pixel is the median of the 24 pixels of a square of 5 x 5, black counting as 0.1, but at
/// least that of any of them that is known, such as a lamp beside its edge. Throws like predicted_relmse().
Fireflies fireflies_in(const EstimatorResult& result);

/// Bounds that contain the relMSE in 80 of 100 renders (error_interval.h).
struct PredictedBounds {
  double low = 0, high = 0;
};

/// The predicted relMSE of an image.
struct PredictedError {
  double relmse = 0;                      ///< predicted_relmse(), or the middle of the interval
  std::optional<PredictedBounds> bounds;  ///< around it; empty if unknown (EstimatorResult::interval)
  /// Why it is unreliable; empty if it is reliable. With an interval: it is wider than kReliableFactor of
  /// error_interval.h, or cannot be given. Otherwise: there are few samples per pixel; or 1 % of the pixels hold more
  /// than 40 % of the error. Light that no sample has found is not seen here either. Measured in
  /// docs/methods/error-estimates.md.
  std::string doubt;
};

/// For a result with standard errors; empty if it has none. `samples`: per pixel, of all passes together, infinite if
/// unknown; fewer than `reliable_samples` (Method::reliable_samples) are few.
std::optional<PredictedError> predicted_error(const EstimatorResult& result, double samples, uint32_t reliable_samples);

}  // namespace covary
