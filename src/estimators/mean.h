// SPDX-License-Identifier: Apache-2.0
// The plain mean of an image's groups.
#pragma once

#include "estimators/estimator_result.h"
#include "film/grouped_image.h"

namespace covary {

/// Mean of the groups (unbiased) and, with two or more of them, its standard error (square root of an unbiased
/// estimate). For groups of independent samples; errors of a CRN image have the same size but are correlated between
/// pixels.
///
/// Groups of unequal sizes n_t, N in total, are weighted by them: mean m = sum n_t m_t / N, and its squared error sum
/// n_t (m_t - m)^2 / ((T - 1) N), unbiased as well. In a pixel with fewer samples than groups, T is the number of
/// nonempty groups; its standard error is infinite if there is at most one. Pixels are independent of each other's
/// counts. For images that keep the sample variance, the standard error follows from it, for any number of groups;
/// infinite with fewer than two samples.
EstimatorResult mean_of_groups(const GroupedImage& image);

}  // namespace covary
