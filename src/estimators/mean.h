// SPDX-License-Identifier: Apache-2.0
// The plain mean of an image's groups.
#pragma once

#include "estimators/grouped_image.h"

namespace covary {

/// Mean of the groups and, with two or more of them, its standard error: unbiased and sqrt of unbiased, in that order. For
/// groups of independent samples; errors of a CRN image are of this size too, but correlated between pixels.
EstimatorResult mean_of_groups(const GroupedImage& image);

}  // namespace covary
