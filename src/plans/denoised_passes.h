// SPDX-License-Identifier: Apache-2.0
// Two independent passes of one denoised mean: where the second is to take its samples, and both together.
#pragma once

#include <functional>
#include <vector>

#include "estimators/estimator.h"
#include "plans/plan.h"

namespace covary {

/// Estimator::apply of a denoised mean.
using DenoisedMean =
    std::function<EstimatorResult(const GroupedImage& crn, const GroupedImage& independent, const PairSettings&)>;

/// For sample_counts(): squared relative errors of the denoised image of `first`, of each pixel, over the cost of
/// samples there. All 0 where the image does not know its error.
std::vector<double> filtered_errors(const DenoisedMean& denoise, const Film& first, const PlanState& state);

/// The film of the samples of both, which have the same groups, of equal sizes in each pixel of `first`. The second's
/// numbers of samples follow from the first's values over many pixels, so that the sum is only nearly unbiased
/// (docs/notes/adaptive-counts.md).
Film joined(const Film& first, const Film& last);

}  // namespace covary
