// SPDX-License-Identifier: Apache-2.0
// The plan that finds out whether common random numbers pay (ours): samples are independent, but for a trial.
#pragma once

#include <optional>

#include "estimators/estimator.h"
#include "plans/plan.h"

namespace covary {

/// `mean`: the mean of independent samples, denoised; `pair`: an estimator of two passes, denoised likewise.
///
/// The first phase takes an eighth of the samples, "first-1", and a fourth of these with common random numbers,
/// "crn-1". The images that `mean` makes of the former and `pair` of both are judged by the same held-out samples, and
/// the former's error is taken to fall like 1 / samples, which favours it. Only where `pair` has less error
/// nevertheless does the last phase, "crn" and "independent", bring the common random numbers to a fourth of all
/// samples; otherwise all that follow are independent. With few samples nothing is tried.
///
/// The trial follows from the number of samples that is wanted first, so that an interrupted render chooses as one that
/// was not.
Plan split_plan(const Estimator& mean, const Estimator& pair, std::optional<int> groups = {});

}  // namespace covary
