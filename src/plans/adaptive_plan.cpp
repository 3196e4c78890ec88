// SPDX-License-Identifier: Apache-2.0
#include "plans/adaptive_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/error.h"
#include "estimators/mean.h"
#include "plans/budget.h"
#include "plans/render.h"

namespace covary {
namespace {

constexpr uint32_t kMostFirst = 50;    // samples of the first pass where nobody asks for a number
constexpr double kFirstShare = 0.5;    // of the budget or the time, at most
constexpr double kOverestimate = 1.1;  // of the samples that a limit of time allows

struct Method {
  AdaptiveSampling sampling;
  std::string name;
  int groups = 1;
};

/// Samples per pixel of the first pass.
uint32_t first_samples(const Method& method, const PlanState& state) {
  if (method.sampling.first_spp) return static_cast<uint32_t>(*method.sampling.first_spp);
  const auto part = static_cast<uint32_t>(kFirstShare * state.group_budget);
  const bool is_open = method.sampling.counts.relative_error && !state.request.spp;
  const uint32_t samples = is_open ? kMostFirst : std::min(part, kMostFirst);
  const auto groups = static_cast<uint32_t>(method.groups);
  return std::max(samples / groups, 1u) * groups;
}

/// Samples per pixel that may be taken in all; infinite where only a relative error says how many.
double whole_budget(const Method& method, const PlanState& state) {
  const bool is_open = method.sampling.counts.relative_error && !state.request.spp && !state.seconds_left;
  return is_open ? std::numeric_limits<double>::infinity() : state.budget;
}

void check_budget(const Method& method, const PlanState& state, uint32_t first) {
  const double budget = whole_budget(method, state);
  const int least = std::max({1, method.sampling.counts.min_spp, method.groups});
  if (budget >= static_cast<double>(first) + least) return;
  throw Error(ErrorCode::kUsage,
              fmt::format("{} samples per pixel are too few for {}: its first pass takes {} (--dependent-spp), and at "
                          "least {} must be left for the last one",
                          budget, method.name, first, least));
}

/// Samples per pixel that the time left is enough for.
double samples_in_time(const PlanState& state) {
  const CropWindow window = window_of(state.scene, state.request);
  const FilterSettings filter = state.request.filter.value_or(state.scene.filter);
  const double speed = samples_per_second(state.scene, *state.integrator, filter, window);
  const double pixels = static_cast<double>(window.width) * window.height;
  return std::floor(std::max(1.0, kOverestimate * std::max(0.0, *state.seconds_left) * speed / pixels));
}

SampleTarget last_target(const Method& method, const PlanState& state, const Film& first) {
  double budget = whole_budget(method, state) - first.mean_count();
  if (state.seconds_left) budget = std::min(budget, samples_in_time(state));
  return SampleTarget(sample_counts(rows_of(first, 0, first.height()), std::max(0.0, budget), method.sampling.counts,
                                    static_cast<uint32_t>(method.groups)));
}

PassPlan pass_of(const std::string& name, Sampling sampling, uint32_t number, const Method& method) {
  PassPlan pass;
  pass.name = name;
  pass.number = number;
  pass.sampling = sampling;
  pass.groups = method.groups;
  pass.sample_variance = true;
  return pass;
}

EstimatorResult mean_of_last(std::span<const Pass> passes, int first_row, int n_rows) {
  return mean_of_groups(rows_of(passes.back().film, first_row, n_rows));
}

}  // namespace

Plan adaptive_plan(const Estimator& estimator, std::optional<int> groups) {
  const bool is_pair = estimator.passes == EstimatorPasses::kPair;
  Method method{*estimator.adaptive, estimator.name, groups.value_or(1)};
  Plan plan;
  plan.name = estimator.name;
  plan.estimator = estimator.text;
  plan.predicts_error = estimator.predicts_error;
  plan.takes_unfinished = is_pair;
  plan.has_crn_pass = is_pair;
  plan.estimate = mean_of_last;
  if (is_pair) {
    plan.estimate_bytes_per_pixel = estimator.bytes_per_pixel;
    plan.estimate = [apply = estimator.apply](std::span<const Pass> passes, int first_row, int n_rows) {
      return apply(rows_of(passes[0].film, first_row, n_rows), rows_of(passes[1].film, first_row, n_rows), {});
    };
  }
  Phase first, last;
  first.share = last.share = kFirstShare;
  first.passes = [=](const PlanState&) {
    return std::vector{is_pair ? pass_of("crn", Sampling::kCrn, 0, method)
                               : pass_of("pilot", Sampling::kIndependent, 1, method)};
  };
  first.set_targets = [=](const PlanState& state, std::span<Pass> passes) {
    const uint32_t samples = first_samples(method, state);
    check_budget(method, state, samples);
    passes[0].settings.spp = samples;
  };
  last.passes = [=](const PlanState&) {
    return std::vector{pass_of("independent", Sampling::kIndependent, 0, method)};
  };
  last.set_targets = [=](const PlanState& state, std::span<Pass> passes) {
    passes[0].settings.spp = last_target(method, state, state.passes[0].film);
  };
  plan.phases = {first, last};
  return plan;
}

}  // namespace covary
