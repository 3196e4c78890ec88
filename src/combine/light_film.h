// SPDX-License-Identifier: Apache-2.0
// Light films (film/splat_layer.h) that accompany images of camera samples.
#pragma once

#include "combine/grouped_source.h"
#include "estimators/estimator_result.h"
#include "film/grouped_image.h"

namespace covary {

/// Adds the mean of rows of a light film to an image made from camera samples only, starting at its row `first_row`.
/// Both are independent, so their variances add; if `result` has a standard error, the light film needs at least two
/// groups. Throws Error(kInput).
void add_light(const GroupedImage& light, EstimatorResult& result, int first_row = 0);

/// The sum of samples and a light film with as many groups, group by group; counts are those of the samples.
GroupedSource with_light(const GroupedSource& samples, const GroupedSource& light);

}  // namespace covary
