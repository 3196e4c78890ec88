// SPDX-License-Identifier: Apache-2.0
// The plans of the estimators there are (combine/registry.h). Each has one phase, or two (adaptive_plan.h).
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

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

/// An estimator of two images of groups: one with common random numbers, one with independent ones.
struct PairMethod {
  std::string name;       ///< for messages
  std::string estimator;  ///< with its options, for the image's attribute
  std::string network;    ///< Estimator::network
  /// Parts of the samples for the CRN and the independent pass; they add up to 1.
  std::array<double, 2> split = {0.5, 0.5};
  /// Of each pass; default: number_of_groups() of budget.h, 4 to 12. A pass takes at least one sample for each.
  std::optional<int> groups;
  int fewest_groups = 3;  ///< that the estimator works with
  bool predicts_error = false;
  uint32_t reliable_samples = 0;  ///< Estimator::reliable_samples
  EstimatorMemory memory;         ///< that `estimate` takes
  bool reads_guides = false;      ///< `estimate` reads PairSettings::guides
  std::function<EstimatorResult(const GroupedImage& crn, const GroupedImage& independent, const PairSettings& settings)>
      estimate;
};
/// Passes "crn" and "independent" that advance together, and the estimator. Rendering throws Error(kUsage) where
/// `groups` is less than `fewest_groups`.
Plan pair_plan(const PairMethod& method);

/// What a render may choose of an estimator's passes.
struct PassChoice {
  Sampling sampling = Sampling::kIndependent;  ///< of estimators whose one pass may be of either kind
  std::optional<int> groups;                   ///< default: as the plans above have it
  std::optional<std::array<double, 2>> split;  ///< default: Estimator::split
  bool chooses_split = false;                  ///< render_plan() of render_settings.h finds it out (split_plan.h)
};
/// The one of these plans that the estimator needs.
Plan estimator_plan(const Estimator& estimator, const PassChoice& choice = {});

}  // namespace covary
