// SPDX-License-Identifier: Apache-2.0
// Two independent passes of one denoised mean: sampling of the second one, and the film of both.
#pragma once

#include <vector>

#include "estimators/method.h"
#include "plans/plan.h"

namespace covary {

/// OnePass::image of a denoised mean.
using DenoisedMean = decltype(OnePass::image);

/// For sample_counts(): squared relative error of the denoised image of `first` at each pixel, over the cost of a
/// sample there. All 0 if the image has no error estimate.
std::vector<double> filtered_errors(const DenoisedMean& denoise, const Film& first, const PlanState& state);

/// The sum of both passes' films, with the same groups; in each pixel of `first` they are of equal size. The second's
/// sample counts depend on the first's values over many pixels, so the sum is only nearly unbiased
/// (docs/notes/adaptive-counts.md).
Film joined(const Film& first, const Film& last);

}  // namespace covary
