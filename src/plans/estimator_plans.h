// SPDX-License-Identifier: Apache-2.0
// The plans of the estimators there are (combine/registry.h). Each has one phase, or two (adaptive_plan.h).
#pragma once

#include <array>
#include <optional>

#include "estimators/estimator.h"
#include "plans/plan.h"

namespace covary {

/// One pass whose film is the result. `groups`: by default as number_of_groups() of budget.h has it for common random
/// numbers and for a render to a wanted error, which is read from the groups, otherwise 1.
Plan plain_plan(Sampling sampling, std::optional<int> groups = {});

/// One independent pass in groups (EstimatorPasses::kIndependent), by default as many as number_of_groups() has it.
Plan independent_plan(const Estimator& estimator, std::optional<int> groups = {});

/// One independent pass, whose pixels an estimator makes of all their samples (EstimatorPasses::kSamples). Throws
/// Error(kUsage) when rendered with a number of samples that the estimator does not take.
Plan samples_plan(const Estimator& estimator);

/// What a render may choose of an estimator's passes.
struct PassChoice {
  Sampling sampling = Sampling::kIndependent;  ///< of estimators whose one pass may be of either kind
  std::optional<int> groups;                   ///< default: as the plans here have it
  std::optional<std::array<double, 2>> split;  ///< default: Estimator::split
  bool chooses_split = false;                  ///< render_plan() of render_settings.h finds it out (split_plan.h)
};

/// Passes "crn" and "independent" that advance together, and an estimator of both. Groups of each: by default as
/// number_of_groups() of budget.h has it, 4 to 12; a pass takes at least one sample for each. Rendering throws
/// Error(kUsage) where `choice` has fewer than the estimator needs.
Plan pair_plan(const Estimator& estimator, const PassChoice& choice = {});

/// The one of these plans that the estimator needs.
Plan estimator_plan(const Estimator& estimator, const PassChoice& choice = {});

/// A plan without phases and estimate, with what the estimator says of itself.
Plan plan_of(const Estimator& estimator);

}  // namespace covary
