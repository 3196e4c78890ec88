// SPDX-License-Identifier: Apache-2.0
#include "plans/adaptive_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/error.h"
#include "core/stopwatch.h"
#include "denoising/mixed_denoising.h"
#include "estimators/mean.h"
#include "plans/budget.h"
#include "plans/denoised_passes.h"
#include "plans/estimator_plans.h"
#include "plans/render.h"
#include "risk/error_interval.h"
#include "risk/image_risk.h"

namespace covary {
namespace {

constexpr double kFirstShare = 0.5;        // maximum fraction of the budget or the time
constexpr double kShareOfFirst = 1.0 / 3;  // fraction of the budget if it is part of the image
constexpr double kOverestimate = 1.1;      // factor on the samples that the time limit allows

constexpr uint32_t kFirstOfError = 50;  // samples of the first pass if a relative error determines the rest

struct AdaptiveMethod {
  AdaptiveSampling sampling;
  std::string name;
  std::optional<int> groups;  ///< as requested
  int min_groups = 1;
  DenoisedMean denoise;  ///< of a denoised mean, which includes the first pass

  /// Groups of both films.
  uint32_t groups_of(const PlanState& state) const {
    if (groups) return static_cast<uint32_t>(*groups);
    if (denoise) return static_cast<uint32_t>(number_of_groups({{1.0}, 1}, state));
    if (!sampling.reads_groups) return 1;
    constexpr uint32_t kEnough = 4;  // as for other two-pass estimators
    return static_cast<uint32_t>(number_of_groups({{kFirstShare, 1 - kFirstShare}, kEnough}, state));
  }
};

/// Samples per pixel of the first pass.
uint32_t first_samples(const AdaptiveMethod& method, const PlanState& state) {
  if (method.sampling.first_spp) return static_cast<uint32_t>(*method.sampling.first_spp);
  const uint32_t groups = method.groups_of(state);
  if (method.denoise) {
    const double part = std::max<double>(kShareOfFirst * state.budget, kMinMixedSamples);
    return std::max(static_cast<uint32_t>(std::lround(part / groups)), 1u) * groups;
  }
  const auto part = static_cast<uint32_t>(kFirstShare * state.group_budget);
  const bool is_open = method.sampling.counts.relative_error && !state.request.spp;
  const uint32_t samples = is_open ? kFirstOfError : std::min<uint32_t>(part, method.sampling.max_first_spp);
  return std::max(samples / groups, 1u) * groups;
}

/// Maximum samples per pixel; infinite if only a relative error limits them.
double whole_budget(const AdaptiveMethod& method, const PlanState& state) {
  const bool is_open = method.sampling.counts.relative_error && !state.request.spp && !state.seconds_left;
  return is_open ? std::numeric_limits<double>::infinity() : state.budget;
}

/// An estimator that reads groups needs some, each with a sample of the first pass.
void check_groups(const AdaptiveMethod& method, const PlanState& state, uint32_t first) {
  if (!method.sampling.reads_groups) return;
  const uint32_t groups = method.groups_of(state);
  if (groups < static_cast<uint32_t>(method.min_groups))
    throw Error(ErrorCode::kUsage,
                fmt::format("{} groups are too few: {} needs at least {}", groups, method.name, method.min_groups));
  if (first < groups)
    throw Error(ErrorCode::kUsage, fmt::format("dependent-spp is {}, expected at least {}, one sample for each group "
                                               "(`groups`)",
                                               first, groups));
}

void check_budget(const AdaptiveMethod& method, const PlanState& state, uint32_t first) {
  const double budget = whole_budget(method, state);
  const int least = std::max({1, method.sampling.counts.min_spp, static_cast<int>(method.groups_of(state))});
  if (budget >= static_cast<double>(first) + least) return;
  throw Error(ErrorCode::kUsage,
              fmt::format("{} samples per pixel are too few for {}: its first pass takes {} (`dependent-spp`), and at "
                          "least {} must be left for the last one",
                          budget, method.name, first, least));
}

/// Samples per pixel for which the time suffices that was left `seconds_ago`.
double samples_in_time(const PlanState& state, double seconds_ago) {
  const CropWindow window = window_of(state.scene, state.request);
  const FilterSettings filter = state.request.filter.value_or(state.scene.filter);
  const double speed = samples_per_second(state.scene, *state.integrator, filter, window, state.stop);
  const double pixels = static_cast<double>(window.width) * window.height;
  return std::floor(std::max(1.0, kOverestimate * std::max(0.0, *state.seconds_left - seconds_ago) * speed / pixels));
}

/// Whether an error map of these samples shows where errors are, rather than where single bright paths landed.
bool tells_where_errors_are(const GroupedImage& image) {
  MethodImage mean = mean_of_groups(image);
  add_risk_of_mean(image, mean);
  return mean.risk_rows.empty() || !has_rare_light(sum_of(mean.risk_rows));
}

void set_last_target(const AdaptiveMethod& method, const PlanState& state, Pass& last) {
  const Stopwatch watch;
  const Film& first = state.passes[0].film;
  const GroupedImage image = rows_of(first, 0, first.height());
  CountOptions options = method.sampling.counts;
  const uint32_t multiple = method.denoise ? 1 : method.groups_of(state);
  std::vector<double> filtered;
  if (options.allocation == Allocation::kDenoised) {
    if (tells_where_errors_are(image))
      filtered = filtered_errors(method.denoise, first, state);
    else
      options.allocation = Allocation::kUniform;
  }
  double budget = whole_budget(method, state) - first.mean_count();
  if (state.seconds_left) budget = std::min(budget, samples_in_time(state, watch.seconds()));
  std::vector<uint32_t> counts = sample_counts(image, std::max(0.0, budget), options, multiple, filtered);
  last.misses_error = !have_relative_error(image, counts, options, multiple);
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

}  // namespace

Plan adaptive_plan(const Method& estimator, std::optional<int> groups) {
  const bool is_pair = estimator.pair() != nullptr, is_denoised = !is_pair && !estimator.is_mean();
  if (estimator.adaptive->counts.relative_error && is_denoised)
    throw Error(ErrorCode::kUsage,
                "`until` relative is for an image that is not denoised; relmse adds samples until a denoised one has a "
                "wanted error");
  const AdaptiveMethod method{*estimator.adaptive, estimator.name, groups, estimator.min_groups,
                              is_denoised ? estimator.one_pass()->image : DenoisedMean()};
  Plan plan = plan_of(estimator);
  plan.takes_unfinished = is_denoised || (is_pair && !method.sampling.reads_groups);
  plan.groups_follow_speed = is_denoised && !groups;
  plan.has_crn_pass = is_pair;
  plan.adds_films = is_denoised;
  Phase first, last;
  first.share = last.share = kFirstShare;
  first.passes = [=](const PlanState& state) {
    const uint32_t n_groups = method.groups_of(state);
    std::vector passes = {is_pair ? pass_of("crn", Sampling::kCrn, 0, n_groups)
                                  : pass_of(is_denoised ? "first" : "pilot", Sampling::kIndependent, 1, n_groups)};
    passes[0].sample_variance = !is_denoised;
    return passes;
  };
  first.set_targets = [=](const PlanState& state, std::span<Pass> passes) {
    const uint32_t samples = first_samples(method, state);
    check_groups(method, state, samples);
    method.sampling.counts.check_limits(method.groups_of(state));
    check_budget(method, state, samples);
    passes[0].settings.spp = samples;
  };
  last.passes = [=](const PlanState& state) {
    std::vector passes = {pass_of("independent", Sampling::kIndependent, 0, method.groups_of(state))};
    passes[0].sample_variance = !is_denoised;
    return passes;
  };
  last.set_targets = [=](const PlanState& state, std::span<Pass> passes) { set_last_target(method, state, passes[0]); };
  plan.phases = {first, last};
  return plan;
}

}  // namespace covary
