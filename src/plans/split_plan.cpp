// SPDX-License-Identifier: Apache-2.0
#include "plans/split_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/stop.h"
#include "plans/budget.h"
#include "plans/denoised_passes.h"
#include "plans/estimator_plans.h"
#include "plans/render.h"

namespace covary {
namespace {

constexpr double kTrialShare = 1.0 / 8;  // of the samples
constexpr double kCrnShare = 1.0 / 4;    // fraction of the trial's samples, and of all if it wins
/// Least samples per pixel at which common random numbers were found to win (docs/notes/denoising.md).
constexpr uint32_t kFewestTried = 256;

struct Method {
  Estimator mean, pair;
  std::optional<int> groups;

  bool is_tried(const PlanState& state) const {
    return state.group_budget >= kFewestTried && groups.value_or(pair.fewest_groups) >= pair.fewest_groups;
  }
  int groups_of(const PlanState& state) const {
    constexpr double kCrn = kTrialShare * kCrnShare;
    const auto fewest = static_cast<uint32_t>(pair.fewest_groups);
    return groups.value_or(
        number_of_groups(is_tried(state) ? Shares{{kCrn, 1 - kCrn}, fewest} : Shares{{1}, 1}, state));
  }
};

std::string reason(const SplitTrial& trial) {
  if (trial.samples == 0)
    return fmt::format(
        "`split` auto uses independent samples only: common random numbers are tried from {} samples per pixel on, "
        "with enough groups",
        kFewestTried);
  return fmt::format(
      "`split` auto uses {}: after {:g} samples per pixel, held-out samples predict a relMSE of {:.3g} with common "
      "random numbers and {:.3g} without",
      trial.crn_wins ? "common random numbers for a fourth of the samples" : "independent samples only", trial.samples,
      trial.with_crn, trial.independent);
}

/// Denoises the pair if there is a CRN film, otherwise the mean.
EstimatorResult denoised(const Method& method, const Film* crn, const Film& independent, PairSettings settings,
                         int first_row, int n_rows) {
  settings.std_error = true;
  const GroupedImage rows = rows_of(independent, first_row, n_rows);
  if (!crn) return method.mean.apply({}, rows, settings);
  settings.crn_samples = std::llround(crn->mean_count());
  return method.pair.apply(rows_of(*crn, first_row, n_rows), rows, settings);
}

SplitTrial trial_of(const Method& method, const PlanState& state) {
  SplitTrial trial;
  if (!method.is_tried(state)) return trial;
  const Film &first = state.pass("first", 1).film, &crn = state.pass("crn", 1).film;
  PairSettings settings;
  settings.guides = state.guides;
  const auto held_out = [&](const Film* beside) {
    return denoised(method, beside, first, settings, 0, first.height()).risks.value_or(MeasuredRisks()).held_out;
  };
  const double samples = first.mean_count() + crn.mean_count();
  const auto judge = [&] {
    trial.independent = held_out(nullptr) * first.mean_count() / samples;
    trial.with_crn = held_out(&crn);
  };
  if (!run_stoppable(state.stop, judge)) return trial;  // the render ends
  trial.samples = samples;
  trial.crn_wins = trial.with_crn < trial.independent;
  return trial;
}

/// Passes "first-1" and, if there is a trial, "crn-1"; "independent" and "crn" likewise.
EstimatorResult estimate(const Method& method, std::span<const Pass> passes, int first_row, int n_rows,
                         const Beside& beside) {
  const size_t half = passes.size() / 2;
  const Film independent = joined(passes[0].film, passes[half].film);
  const std::optional<SplitTrial>& trial = passes[half].trial;  // stored in films read from disk
  const bool crn_wins = trial ? trial->crn_wins : half > 1 && passes[half + 1].film.mean_count() > 0;
  std::optional<Film> crn;
  if (crn_wins) crn = joined(passes[1].film, passes[half + 1].film);
  PairSettings settings;
  settings.guides = beside.guides;
  EstimatorResult image = denoised(method, crn ? &*crn : nullptr, independent, settings, first_row, n_rows);
  if (trial) image.note += (image.note.empty() ? "" : "; ") + reason(*trial);
  return image;
}

std::vector<PassPlan> passes_of(const Method& method, const PlanState& state, const char* name, uint32_t number) {
  std::vector<PassPlan> passes(method.is_tried(state) ? 2 : 1);
  passes[0].name = name;
  if (passes.size() > 1) passes[1].name = "crn", passes[1].sampling = Sampling::kCrn;
  for (PassPlan& pass : passes) pass.number = number, pass.groups = method.groups_of(state);
  return passes;
}

/// For the first phase: whole groups; zero without a trial.
void set_first_targets(const PlanState& state, std::span<Pass> passes) {
  for (size_t i = 0; i < passes.size(); ++i) {
    const double groups = passes[i].film.groups();
    const double samples = kTrialShare * (i == 0 ? 1 - kCrnShare : kCrnShare) * state.group_budget;
    const bool is_tried = passes.size() > 1;
    passes[i].settings.spp = static_cast<uint32_t>(is_tried ? groups * std::max(1.0, std::round(samples / groups)) : 0);
  }
}

/// For the last phase.
void set_last_targets(const Method& method, const PlanState& state, std::span<Pass> passes) {
  if (!passes[0].trial) passes[0].trial = trial_of(method, state);
  double before = 0;
  for (size_t i = 0; i < passes.size(); ++i) before += state.passes[i].film.mean_count();
  double crn = 0;
  if (passes[0].trial->crn_wins) crn = std::round(kCrnShare * state.budget) - state.passes[1].film.mean_count();
  crn = std::max(crn, 0.0);
  passes[0].settings.spp = static_cast<uint32_t>(std::max(0.0, state.budget - before - crn));
  if (passes.size() > 1) passes[1].settings.spp = static_cast<uint32_t>(crn);
}

}  // namespace

Plan split_plan(const Estimator& mean, const Estimator& pair, std::optional<int> groups) {
  const Method method{mean, pair, groups};
  Estimator estimator = mean;
  estimator.text += " --split auto";
  estimator.splits_layers = false;
  estimator.memory.always = std::max(mean.memory.always, pair.memory.always);
  estimator.memory.of_halves_per_group = 2 * 3 * sizeof(float);  // the films of both phases
  Plan plan = independent_plan(estimator, groups);
  plan.has_crn_pass = plan.takes_unfinished = true;  // the first phase has samples in all pixels
  plan.estimate = [method](std::span<const Pass> passes, int first_row, int n_rows, const Beside& beside) {
    return estimate(method, passes, first_row, n_rows, beside);
  };
  Phase first, last;
  first.share = last.share = 0.5;
  first.passes = [method](const PlanState& state) { return passes_of(method, state, "first", 1); };
  first.set_targets = set_first_targets;
  last.passes = [method](const PlanState& state) { return passes_of(method, state, "independent", 0); };
  last.set_targets = [method](const PlanState& state, std::span<Pass> passes) {
    set_last_targets(method, state, passes);
  };
  plan.phases = {first, last};
  return plan;
}

}  // namespace covary
