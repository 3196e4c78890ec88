// SPDX-License-Identifier: Apache-2.0
// Plans of two phases, where the first pass decides how many samples each pixel of the last one gets
// (estimators/sample_counts.h).
#pragma once

#include <optional>

#include "estimators/method.h"
#include "plans/plan.h"

namespace covary {

/// For an adaptive estimator. For a pair, the first pass is the CRN pass, "crn"; for a mean, a pilot, "pilot-1", with
/// its own random numbers, which is not part of the image, so that numbers of samples do not depend on its values. The
/// last pass is "independent". Films keep the variance of samples.
///
/// For a denoised mean, the first pass, "first-1", takes a third of the budget and is part of the image. The last one
/// brings pixels to the numbers that Allocation::kDenoised derives from the denoised image of the first.
///
/// The budget is that of both passes; it caps a relative error, or is replaced by it if the request gives no number of
/// samples. With a time limit, the first pass gets at most half of it, and the last as many samples as a speed trial
/// predicts for the rest, plus a tenth so that no time is left over; pixels advance together, so if the prediction was
/// too high, those with most samples fall short.
///
/// `groups`: of both films; default: 1, or number_of_groups() of budget.h if the estimator reads them. Numbers of
/// samples of the last pass are multiples of it. Rendering throws Error(kUsage) if the budget leaves less than one
/// sample, or min_spp, for the last pass, or if an estimator that reads groups gets too few.
Plan adaptive_plan(const Method& estimator, std::optional<int> groups = {});

}  // namespace covary
