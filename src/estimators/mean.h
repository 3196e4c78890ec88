// SPDX-License-Identifier: Apache-2.0
// The plain mean of an image's groups.
#pragma once

#include "estimators/estimator_result.h"
#include "film/grouped_image.h"

namespace covary {

class Settings;
struct Estimator;

/// Mean of the groups and, with two or more of them, its standard error: unbiased and sqrt of unbiased, in that order.
/// For groups of independent samples; errors of a CRN image are of this size too, but correlated between pixels.
///
/// Groups of unequal sizes n_t, N together, are weighted by them: mean m = sum n_t m_t / N, and its squared error
/// sum n_t (m_t - m)^2 / ((T - 1) N), unbiased as well. A pixel with fewer samples than groups has the T of its groups
/// with samples, and an infinite standard error where that is one or none. Every pixel stands alone, whatever the
/// counts of others. Of images that keep the variance of samples, the standard error is from that, for any number of
/// groups; infinite with less than two samples.
EstimatorResult mean_of_groups(const GroupedImage& image);

/// The estimator `none` with these options. Throws Error(kUsage) that lists everything that is wrong with them.
Estimator make_none(Settings& options);

}  // namespace covary
