// SPDX-License-Identifier: Apache-2.0
#include "plans/adaptive_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/error.h"
#include "estimators/mean.h"
#include "plans/budget.h"
#include "plans/render.h"
#include "risk/image_risk.h"

namespace covary {
namespace {

constexpr double kFirstShare = 0.5;    // of the budget or the time, at most
constexpr double kOverestimate = 1.1;  // of the samples that a limit of time allows

constexpr uint32_t kFirstOfError = 50;  // samples of the first pass where a relative error says how many there are

struct Method {
  AdaptiveSampling sampling;
  std::string name;
  std::optional<int> groups;  ///< that were asked for
  int fewest_groups = 1;

  /// Of both films.
  uint32_t groups_of(const PlanState& state) const {
    if (groups) return static_cast<uint32_t>(*groups);
    if (!sampling.reads_groups) return 1;
    constexpr uint32_t kEnough = 4;  // as of other estimators of two passes
    return static_cast<uint32_t>(number_of_groups({{kFirstShare, 1 - kFirstShare}, kEnough}, state));
  }
};

/// Samples per pixel of the first pass.
uint32_t first_samples(const Method& method, const PlanState& state) {
  if (method.sampling.first_spp) return static_cast<uint32_t>(*method.sampling.first_spp);
  const auto part = static_cast<uint32_t>(kFirstShare * state.group_budget);
  const bool is_open = method.sampling.counts.relative_error && !state.request.spp;
  const uint32_t samples = is_open ? kFirstOfError : std::min<uint32_t>(part, method.sampling.most_first_spp);
  const uint32_t groups = method.groups_of(state);
  return std::max(samples / groups, 1u) * groups;
}

/// Samples per pixel that may be taken in all; infinite where only a relative error says how many.
double whole_budget(const Method& method, const PlanState& state) {
  const bool is_open = method.sampling.counts.relative_error && !state.request.spp && !state.seconds_left;
  return is_open ? std::numeric_limits<double>::infinity() : state.budget;
}

/// An estimator that reads groups needs some, each with a sample of the first pass.
void check_groups(const Method& method, const PlanState& state, uint32_t first) {
  if (!method.sampling.reads_groups) return;
  const uint32_t groups = method.groups_of(state);
  if (groups < static_cast<uint32_t>(method.fewest_groups))
    throw Error(ErrorCode::kUsage,
                fmt::format("{} groups are too few: {} needs at least {}", groups, method.name, method.fewest_groups));
  if (first < groups)
    throw Error(ErrorCode::kUsage, fmt::format("dependent-spp is {}, expected at least {}, one sample for each group "
                                               "(`groups`)",
                                               first, groups));
}

void check_counts(const Method& method, const PlanState& state) {
  throw_if_any(method.name, method.sampling.counts.validate(method.groups_of(state)));
}

void check_budget(const Method& method, const PlanState& state, uint32_t first) {
  const double budget = whole_budget(method, state);
  const int least = std::max({1, method.sampling.counts.min_spp, static_cast<int>(method.groups_of(state))});
  if (budget >= static_cast<double>(first) + least) return;
  throw Error(ErrorCode::kUsage,
              fmt::format("{} samples per pixel are too few for {}: its first pass takes {} (`dependent-spp`), and at "
                          "least {} must be left for the last one",
                          budget, method.name, first, least));
}

/// Samples per pixel that the time left is enough for.
double samples_in_time(const PlanState& state) {
  const CropWindow window = window_of(state.scene, state.request);
  const FilterSettings filter = state.request.filter.value_or(state.scene.filter);
  const double speed = samples_per_second(state.scene, *state.integrator, filter, window, state.stop);
  const double pixels = static_cast<double>(window.width) * window.height;
  return std::floor(std::max(1.0, kOverestimate * std::max(0.0, *state.seconds_left) * speed / pixels));
}

void set_last_target(const Method& method, const PlanState& state, Pass& last) {
  const Film& first = state.passes[0].film;
  double budget = whole_budget(method, state) - first.mean_count();
  if (state.seconds_left) budget = std::min(budget, samples_in_time(state));
  const GroupedImage image = rows_of(first, 0, first.height());
  const CountOptions& options = method.sampling.counts;
  const uint32_t groups = method.groups_of(state);
  std::vector<uint32_t> counts = sample_counts(image, std::max(0.0, budget), options, groups);
  last.misses_error = !have_relative_error(image, counts, options, groups);
  last.settings.spp = SampleTarget(std::move(counts));
}

PassPlan pass_of(const std::string& name, Sampling sampling, uint32_t number, uint32_t groups) {
  PassPlan pass;
  pass.name = name;
  pass.number = number;
  pass.sampling = sampling;
  pass.groups = static_cast<int>(groups);
  pass.sample_variance = true;
  return pass;
}

EstimatorResult mean_of_last(std::span<const Pass> passes, int first_row, int n_rows, const Beside&) {
  const GroupedImage groups = rows_of(passes.back().film, first_row, n_rows);
  EstimatorResult mean = mean_of_groups(groups);
  add_risk_of_mean(groups, mean);
  return mean;
}

}  // namespace

Plan adaptive_plan(const Estimator& estimator, std::optional<int> groups) {
  const bool is_pair = estimator.passes == EstimatorPasses::kPair;
  const Method method{*estimator.adaptive, estimator.name, groups, estimator.fewest_groups};
  Plan plan;
  plan.name = estimator.name;
  plan.estimator = estimator.text;
  plan.predicts_error = estimator.predicts_error;
  plan.reliable_samples = estimator.reliable_samples;
  plan.takes_unfinished = is_pair && !method.sampling.reads_groups;
  plan.has_crn_pass = is_pair;
  plan.estimate = mean_of_last;
  if (is_pair) {
    plan.estimate_memory = estimator.memory;
    const bool std_error = estimator.predicts_error;
    plan.estimate = [apply = estimator.apply, std_error](std::span<const Pass> passes, int first_row, int n_rows,
                                                         const Beside&) {
      const Film &crn = passes[0].film, &independent = passes[1].film;
      return apply(rows_of(crn, first_row, n_rows), rows_of(independent, first_row, n_rows),
                   {std::llround(crn.mean_count()), std_error, {}});
    };
  }
  Phase first, last;
  first.share = last.share = kFirstShare;
  first.passes = [=](const PlanState& state) {
    const uint32_t n_groups = method.groups_of(state);
    return std::vector{is_pair ? pass_of("crn", Sampling::kCrn, 0, n_groups)
                               : pass_of("pilot", Sampling::kIndependent, 1, n_groups)};
  };
  first.set_targets = [=](const PlanState& state, std::span<Pass> passes) {
    const uint32_t samples = first_samples(method, state);
    check_groups(method, state, samples);
    check_counts(method, state);
    check_budget(method, state, samples);
    passes[0].settings.spp = samples;
  };
  last.passes = [=](const PlanState& state) {
    return std::vector{pass_of("independent", Sampling::kIndependent, 0, method.groups_of(state))};
  };
  last.set_targets = [=](const PlanState& state, std::span<Pass> passes) { set_last_target(method, state, passes[0]); };
  plan.phases = {first, last};
  return plan;
}

}  // namespace covary
