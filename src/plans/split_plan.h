// SPDX-License-Identifier: Apache-2.0
// A plan that determines by a trial whether common random numbers pay off.
#pragma once

#include <optional>

#include "estimators/estimator.h"
#include "plans/plan.h"

namespace covary {

/// `mean`: the mean of independent samples, denoised; `pair`: an estimator of two passes, denoised likewise.
///
/// The first phase takes an eighth of the samples: three quarters of these independent, "first-1", and a quarter with
/// common random numbers, "crn-1". The same held-out samples judge the image that `mean` makes of the former and the
/// one that `pair` makes of both; the former's error is assumed to fall like 1 / samples, which favours it. If `pair`
/// still has less error, the last phase, "crn" and "independent", brings the common random numbers to a quarter of all
/// samples; otherwise all further samples are independent. With few samples there is no trial.
///
/// The trial depends on the first requested number of samples, so that a resumed render makes the same choice.
Plan split_plan(const Estimator& mean, const Estimator& pair, std::optional<int> groups = {});

}  // namespace covary
