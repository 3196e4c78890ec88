// SPDX-License-Identifier: Apache-2.0
#include "plans/estimator_plans.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "estimators/mean.h"
#include "estimators/polynomials.h"
#include "integrators/primary_sample.h"
#include "plans/budget.h"
#include "plans/render.h"

namespace covary {
namespace {

/// Fits polynomials to the samples of a pixel.
PixelEstimate polynomial_estimate(int dimensions) {
  static_assert(PolynomialsOptions::kMaxDimensions <= kPrimaryDimensions);
  return [dimensions](std::span<const CameraSample> samples) {
    thread_local std::vector<Spectrum> values;
    thread_local std::vector<float> coordinates;
    values.clear();
    for (const CameraSample& sample : samples) values.push_back(sample.radiance);
    primary_coordinates(samples, dimensions, coordinates);
    return polynomials(values, coordinates, dimensions);
  };
}

EstimatorResult mean_of_first(std::span<const Pass> passes, int first_row, int n_rows) {
  return mean_of_groups(rows_of(passes[0].film, first_row, n_rows));
}

void set_only_target(const PlanState& state, std::span<Pass> passes) {
  const double all[] = {1.0};
  set_budget(all, state.budget, passes);
}

}  // namespace

Plan plain_plan(Sampling sampling, std::optional<int> groups) {
  Plan plan;
  plan.name = plan.estimator = "none";
  plan.film_is_image = plan.predicts_error = true;
  plan.estimate = mean_of_first;
  Phase phase;
  phase.passes = [=](const PlanState& state) {
    PassPlan pass;
    pass.name = sampling == Sampling::kCrn ? "crn" : "independent";
    pass.sampling = sampling;
    pass.groups = groups.value_or(sampling == Sampling::kCrn || state.request.until > 0 ? kUsualGroups : 1);
    pass.fewest_groups = groups ? 0 : 1;
    return std::vector{pass};
  };
  phase.set_targets = set_only_target;
  plan.phases = {phase};
  return plan;
}

Plan polynomials_plan(int dimensions, const std::string& text) {
  Plan plan;
  plan.name = "polynomials";
  plan.estimator = text;
  plan.film_is_image = plan.fixed_samples = true;
  plan.estimate = mean_of_first;
  Phase phase;
  phase.passes = [=](const PlanState& state) {
    throw_if_any("polynomials", PolynomialsOptions{dimensions, state.group_budget}.validate());
    PassPlan pass;
    pass.name = "independent";
    pass.estimate = polynomial_estimate(dimensions);
    pass.estimator = text;
    // The number of samples belongs to the settings: an estimate of few samples cannot become one of more.
    pass.settings = fmt::format("; polynomials dimensions={} samples={}", dimensions, state.group_budget);
    return std::vector{pass};
  };
  phase.set_targets = set_only_target;
  plan.phases = {phase};
  return plan;
}

Plan pair_plan(const PairMethod& method) {
  Plan plan;
  plan.name = method.name;
  plan.estimator = method.estimator;
  plan.predicts_error = method.predicts_error;
  plan.groups_follow_speed = !method.groups;
  plan.estimate_bytes_per_pixel = method.bytes_per_pixel;
  plan.estimate = [estimate = method.estimate](std::span<const Pass> passes, int first_row, int n_rows) {
    const auto crn_samples = static_cast<int64_t>(std::llround(passes[0].film.mean_count()));
    return estimate(rows_of(passes[0].film, first_row, n_rows), rows_of(passes[1].film, first_row, n_rows),
                    crn_samples);
  };
  Phase phase;
  phase.passes = [method](const PlanState& state) {
    const double smaller = std::min(method.split[0], method.split[1]);
    const int groups = number_of_groups(method.name, method.groups, method.fewest_groups, smaller, state.group_budget);
    std::vector<PassPlan> passes(2);
    passes[0].name = "crn", passes[0].sampling = Sampling::kCrn;
    passes[1].name = "independent";
    for (PassPlan& pass : passes) {
      pass.groups = groups;
      pass.fewest_groups = method.groups ? 0 : method.fewest_groups;
    }
    return passes;
  };
  phase.set_targets = [split = method.split](const PlanState& state, std::span<Pass> passes) {
    set_budget(split, state.budget, passes);
  };
  plan.phases = {phase};
  return plan;
}

}  // namespace covary
