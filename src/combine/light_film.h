// SPDX-License-Identifier: Apache-2.0
// Light films (film/splat_layer.h) beside images of camera samples.
#pragma once

#include "estimators/estimator_result.h"
#include "film/grouped_image.h"

namespace covary {

/// Adds the mean of rows of a light film to an image made of camera samples alone, from its row `first_row` on. Both
/// are independent, so their variances add; if `result` has a standard error, the light film needs two groups or more.
/// Throws Error(kInput).
void add_light(const GroupedImage& light, EstimatorResult& result, int first_row = 0);

}  // namespace covary
