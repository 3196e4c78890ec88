// SPDX-License-Identifier: Apache-2.0
// The plans of the registered estimators (combine/registry.h). Each has one phase, or two (adaptive_plan.h).
#pragma once

#include <array>
#include <optional>

#include "estimators/method.h"
#include "plans/plan.h"

namespace covary {

/// One pass whose film is the result. `groups`: by default number_of_groups() of budget.h for common random numbers and
/// for a render to a target error, which is read from the groups; otherwise 1.
Plan plain_plan(Sampling sampling, std::optional<int> groups = {});

/// One independent pass in groups (OnePass), by default number_of_groups() of them.
Plan independent_plan(const Method& estimator, std::optional<int> groups = {});

/// One independent pass; the estimator makes each pixel from all its samples (PixelPass). Rendering
/// throws Error(kUsage) for a number of samples that the estimator does not take.
Plan samples_plan(const Method& estimator);

/// What a render may choose about an estimator's passes.
struct PassChoice {
  Sampling sampling = Sampling::kIndependent;       ///< for estimators whose one pass may be of either kind
  std::optional<int> groups = {};                   ///< default: as the plans here choose
  std::optional<std::array<double, 2>> split = {};  ///< default: equal
};

/// Passes "crn" and "independent" that advance together, and a two-pass estimator. Groups of each: by default
/// number_of_groups() of budget.h, 4 to 12; a pass takes at least one sample per group. Rendering throws Error(kUsage)
/// if `choice` has fewer groups than the estimator needs.
Plan pair_plan(const Method& estimator, const PassChoice& choice = {});

/// The one of these plans that the estimator needs.
Plan estimator_plan(const Method& estimator, const PassChoice& choice = {});

/// A plan without phases.
Plan plan_of(const Method& method);

}  // namespace covary
