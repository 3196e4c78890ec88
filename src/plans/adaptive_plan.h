// SPDX-License-Identifier: Apache-2.0
// Plans of two phases, where the first pass says how many samples each pixel of the last one gets
// (estimators/sample_counts.h).
#pragma once

#include <optional>

#include "estimators/estimator.h"
#include "plans/plan.h"

namespace covary {

/// For an estimator with `adaptive`. Of a pair, the first pass is the CRN pass, "crn"; of a mean, a pilot, "pilot-1",
/// of random numbers of its own that is not part of the image, so that numbers of samples do not depend on their
/// values. The last pass is "independent". Films keep the variance of samples.
///
/// Of a mean that is denoised, the first pass, "first-1", takes a third of the budget and is a part of the image. The
/// last one brings pixels to the numbers that Allocation::kDenoised has from the denoised image of the first.
///
/// The budget is that of both passes; a relative error takes its place where the request names no number of samples,
/// and is otherwise limited by it. With a limit of time, the first pass gets at most half of it, and the last as many
/// samples as a trial of its speed promises for what is left, and a tenth more, so that none is left over; pixels
/// advance together, so that those with most samples lack some where the promise was not kept.
///
/// `groups`: of both films; default: 1, or number_of_groups() of budget.h where the estimator reads them. Numbers of
/// samples of the last pass are multiples of it. Rendering throws Error(kUsage) where the budget leaves less than one
/// sample, or min_spp, for the last pass, and where an estimator that reads groups gets too few.
Plan adaptive_plan(const Estimator& estimator, std::optional<int> groups = {});

}  // namespace covary
