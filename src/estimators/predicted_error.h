// SPDX-License-Identifier: Apache-2.0
// What an estimator's own error estimate says about the whole image.
#pragma once

#include "estimators/grouped_image.h"

namespace covary {

/// relMSE that the standard errors of `result` predict, with the estimate in place of the reference:
///     1 / (3N) sum ||StdError||^2 / (F'^2 + 0.01),   F': mean of the pixel's three values.
/// Pixels that are not finite are left out. Throws Error(kUsage) where `result` has no standard error.
double predicted_relmse(const EstimatorResult& result);

/// The same of the block of 16 x 16 pixels (smaller at the right and lower edge) that 95 % of the blocks do not exceed:
/// how bad the worst regions are.
double predicted_blocks(const EstimatorResult& result);

}  // namespace covary
