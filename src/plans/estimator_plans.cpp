// SPDX-License-Identifier: Apache-2.0
#include "plans/estimator_plans.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "integrators/primary_sample.h"
#include "plans/adaptive_plan.h"
#include "plans/budget.h"
#include "plans/denoised_passes.h"
#include "plans/light_plan.h"
#include "plans/render.h"
#include "risk/plain_mean.h"

namespace covary {
namespace {

PixelEstimate pixel_estimate(const PixelFunction& estimate, int dimensions) {
  COVARY_CHECK(dimensions <= kPrimaryDimensions, "an estimator reads more random numbers than samples begin with");
  return [=](std::span<const CameraSample> samples) {
    thread_local std::vector<Spectrum> values;
    thread_local std::vector<float> coordinates;
    values.clear();
    for (const CameraSample& sample : samples) values.push_back(sample.radiance);
    primary_coordinates(samples, dimensions, coordinates);
    return estimate(values, coordinates);
  };
}

/// A single pass of `groups` groups takes the whole budget.
Shares whole_budget(int groups) { return {{1.0}, static_cast<uint32_t>(groups)}; }

void set_only_target(const PlanState& state, std::span<Pass> passes) {
  set_budget(whole_budget(passes[0].plan.groups), state, passes);
}

/// The same for all methods that need no more, so that they can share films: at least four groups.
Shares shares_of(const Method& estimator, const PassChoice& choice) {
  constexpr int kEnough = 4;
  const int fewest = choice.groups.value_or(std::max(kEnough, estimator.min_groups));
  const std::array<double, 2> split = choice.split.value_or(std::array{0.5, 0.5});
  return {{split.begin(), split.end()}, static_cast<uint32_t>(fewest)};
}

}  // namespace

Plan plan_of(const Method& method) {
  Plan plan;
  plan.method = std::make_shared<const Method>(method);
  return plan;
}

Plan plain_plan(Sampling sampling, std::optional<int> groups) {
  Settings defaults;
  Plan plan = plan_of(make_none(defaults));
  plan.has_crn_pass = sampling == Sampling::kCrn;
  plan.takes_training = !plan.has_crn_pass;
  Phase phase;
  phase.passes = [=](const PlanState& state) {
    PassPlan pass;
    pass.name = sampling == Sampling::kCrn ? "crn" : "independent";
    pass.sampling = sampling;
    const bool reads_groups = sampling == Sampling::kCrn || state.request.until > 0;
    const int fewest = state.request.until > 0 ? 2 : 1;  // two for the error
    pass.groups = groups.value_or(reads_groups ? number_of_groups(whole_budget(fewest), state) : 1);
    pass.min_groups = groups ? 0 : fewest;
    return std::vector{pass};
  };
  phase.set_targets = set_only_target;
  plan.phases = {phase};
  return plan;
}

Plan independent_plan(const Method& estimator, std::optional<int> groups) {
  Plan plan = plan_of(estimator);
  plan.groups_follow_speed = !groups;
  Phase phase;
  phase.passes = [groups](const PlanState& state) {
    PassPlan pass;
    pass.name = "independent";
    pass.groups = groups.value_or(number_of_groups(whole_budget(1), state));
    pass.min_groups = groups ? 0 : 1;
    return std::vector{pass};
  };
  phase.set_targets = set_only_target;
  plan.phases = {phase};
  return plan;
}

Plan samples_plan(const Method& estimator) {
  Plan plan = plan_of(estimator);
  Phase phase;
  phase.passes = [of = *estimator.pixel_pass(), name = estimator.name, text = estimator.text](const PlanState& state) {
    throw_if_any(name, of.check_samples(state.group_budget));
    PassPlan pass;
    pass.name = "independent";
    pass.estimate = pixel_estimate(of.pixel, of.dimensions);
    pass.estimator = text;
    // The number of samples is one of the settings: an estimate from few samples cannot be extended.
    pass.settings = fmt::format("; {} samples={}", of.film_settings, state.group_budget);
    return std::vector{pass};
  };
  phase.set_targets = set_only_target;
  plan.phases = {phase};
  return plan;
}

Plan pair_plan(const Method& estimator, const PassChoice& choice) {
  Plan plan = plan_of(estimator);
  plan.has_crn_pass = true;
  plan.groups_follow_speed = !choice.groups;
  const Shares shares = shares_of(estimator, choice);
  Phase phase;
  phase.passes = [=, name = estimator.name, fewest = estimator.min_groups,
                  chosen = choice.groups](const PlanState& state) {
    const int groups = chosen.value_or(number_of_groups(shares, state));
    if (groups < fewest)
      throw Error(ErrorCode::kUsage, fmt::format("{} groups are too few: {} needs at least {} groups to measure how "
                                                 "pixels vary together",
                                                 groups, name, fewest));
    std::vector<PassPlan> passes(2);
    passes[0].name = "crn", passes[0].sampling = Sampling::kCrn;
    passes[1].name = "independent";
    for (PassPlan& pass : passes) pass.groups = groups, pass.min_groups = chosen ? 0 : fewest;
    return passes;
  };
  phase.set_targets = [shares](const PlanState& state, std::span<Pass> passes) { set_budget(shares, state, passes); };
  plan.phases = {phase};
  return plan;
}

MethodImage image_of(const Plan& plan, std::span<const Pass> passes, int first_row, int n_rows,
                     const ExtraInputs& beside) {
  const Method& method = *plan.method;
  MethodSettings settings;
  settings.crn_samples = std::llround(passes[0].film.mean_count());
  settings.std_error = method.predicts_error;
  // With common random numbers, errors of a mean are correlated between pixels, which variances do not show.
  settings.held_out = method.pair() || passes[0].plan.sampling == Sampling::kIndependent;
  settings.features = beside.features, settings.layers = beside.layers;
  const Film sum = plan.adds_films ? joined(passes[0].film, passes[1].film)
                   : beside.light  ? sum_of_films(passes.back().film, *beside.light)
                                   : Film();
  Samples samples;
  samples.independent = rows_of(plan.adds_films || beside.light ? sum : passes.back().film, first_row, n_rows);
  if (method.pair()) samples.crn = rows_of(passes[0].film, first_row, n_rows);
  return method.image(samples, settings);
}

Plan estimator_plan(const Method& estimator, const PassChoice& choice) {
  if (estimator.adaptive) return adaptive_plan(estimator, choice.groups);
  if (estimator.pair()) return pair_plan(estimator, choice);
  if (estimator.pixel_pass()) return samples_plan(estimator);
  if (estimator.is_mean()) return plain_plan(choice.sampling, choice.groups);
  return independent_plan(estimator, choice.groups);
}

}  // namespace covary
