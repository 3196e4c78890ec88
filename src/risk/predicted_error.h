// SPDX-License-Identifier: Apache-2.0
// What an estimator's own error estimate says about the whole image.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "estimators/estimator_result.h"
#include "film/grouped_image.h"

namespace covary {

/// relMSE that the standard errors of `result` predict, with the estimate in place of the reference:
///     1 / (3N) sum ||StdError||^2 / (F'^2 + 0.01),   F': mean of the pixel's three values.
/// Pixels that are not finite are left out. Throws Error(kUsage) where `result` has no standard error.
double predicted_relmse(const EstimatorResult& result);

/// The same of the block of 16 x 16 pixels (smaller at the right and lower edge) that 95 % of the blocks do not exceed:
/// how bad the worst regions are.
double predicted_blocks(const EstimatorResult& result);

/// Between which the relMSE is in 80 of 100 renders (error_interval.h).
struct PredictedBounds {
  double low = 0, high = 0;
};

/// What is known of the relMSE of an image.
struct PredictedError {
  double relmse = 0;                      ///< predicted_relmse(), or the middle of the interval
  std::optional<PredictedBounds> bounds;  ///< around it; empty where none can be given (EstimatorResult::interval)
  /// Why it is not reliable; empty where it is. Where there is an interval: because it is wider than kReliableFactor of
  /// error_interval.h, or cannot be given. Elsewhere: with few samples per pixel, where a hundredth of the pixels hold
  /// more than two fifths of it, where held-out samples know it only to more than half of itself, and where they tell
  /// more than four times as much as the estimator, or less than a quarter (of results that calibrate() scaled). Light
  /// that no sample has found is not seen here either. Measured in docs/methods/error-estimates.md.
  std::string doubt;
};

/// Of a result with standard errors; empty where it has none. `samples`: per pixel, of all passes together, infinite
/// where nobody knows; fewer than `reliable_samples` (Estimator::reliable_samples) are few.
std::optional<PredictedError> predicted_error(const EstimatorResult& result, double samples, uint32_t reliable_samples);

}  // namespace covary
