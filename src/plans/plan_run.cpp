// SPDX-License-Identifier: Apache-2.0
#include "plans/plan_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "core/error.h"
#include "core/processor_time.h"
#include "film/splat_layer.h"
#include "passes/light_pass.h"
#include "passes/training.h"
#include "plans/budget.h"
#include "plans/folder_lock.h"
#include "plans/integrator_choice.h"
#include "plans/light_plan.h"
#include "plans/memory.h"
#include "plans/pass_files.h"
#include "plans/training_stage.h"

namespace covary {
namespace {

/// Largest factor from one budget to the next towards a target error; smaller if the predicted error is unreliable, so
/// that a prediction that is far too large costs fewer samples before the next check.
constexpr double kMaxGrowth = 4, kDoubtfulGrowth = 2;

std::string filter_text(const FilterSettings& filter) {
  switch (filter.kind) {
    case FilterKind::kBox:
      return fmt::format("box radius={}", filter.radius);
    case FilterKind::kTent:
      return fmt::format("tent radius={}", filter.radius);
    case FilterKind::kGaussian:
      return fmt::format("gaussian radius={} stddev={}", filter.radius, filter.stddev);
    case FilterKind::kLobed:
      return filter.lobed->text();
  }
  throw Error(ErrorCode::kInternal, "unknown reconstruction filter");
}

}  // namespace

PlanRun::PlanRun(const LoadedScene& scene, const Plan& plan, const RenderRequest& request,
                 const RenderCallbacks& callbacks)
    : scene_(scene),
      plan_(plan),
      request_(request),
      callbacks_(callbacks),
      window_(window_of(scene, request)),
      filter_(request.filter.value_or(scene.filter)),
      integrator_(prepared_integrator(scene, plan, request)),
      state_{scene, request_, callbacks.stop, integrator_, 0, 0, {}},
      rounds_(samples_before_check(scene, plan, request)),
      aov_samples_(request.aov_samples) {
  plan_.traces_light = has_light_pass(scene, plan, request);
}

RenderResult PlanRun::run() {
  std::optional<FolderLock> lock;
  if (!request_.passes.empty()) lock.emplace(request_.passes);
  check_earlier_films(plan_, request_);
  try {
    result_.interrupted = !render_to_limits();
    result_.complete = complete() && (!in_rounds() || state_.budget >= largest_budget(scene_, request_));
    if (result_.interrupted && can_estimate() && needs_estimate()) {
      keep_films_before_more();
      estimate();
    }
    for (Pass& pass : state_.passes) pass.film.attributes[film_key::kComplete] = result_.interrupted ? "false" : "true";
    const Stopwatch watch;
    const double before = processor_seconds();
    write_files();
    result_.seconds.processor -= processor_seconds() - before;
    result_.seconds.write += watch.seconds();
    result_.seconds.limited = watch_.seconds();
  } catch (...) {
    keep_films_of_failure();
    throw;
  }
  return std::move(result_);
}

void PlanRun::tell_resumed(std::span<const Pass> passes) {
  if (result_.resumed_samples > 0) return;  // it is told
  for (const Pass& pass : passes) result_.resumed_samples += pass.film.mean_count();
  if (result_.resumed_samples > 0 && callbacks_.resumed) callbacks_.resumed(result_.resumed_samples);
}

void PlanRun::warn_of_missing_light() const {
  if (plan_.traces_light || !scene_.has_delta_lights_and_surfaces || !callbacks_.warning ||
      !integrator_->light_tracing())
    return;
  callbacks_.warning("without light tracing the image lacks visible caustics from point and directional lights");
}

void PlanRun::warn_of_other_sampler() const {
  const std::string& type = scene_.sampler_type;
  // `ldsampler` is what a scene with Sobol' points is converted to.
  const bool is_other = sampler_of(scene_, request_) == Sampler::kSobol && type != "sobol" && type != "ldsampler";
  if (request_.sampler || !callbacks_.warning || !is_other) return;
  callbacks_.warning(fmt::format("the scene's sampler '{}' is rendered as 'sobol' (`sampler`)", type));
}

bool PlanRun::render_to_limits() {
  warn_of_missing_light();
  warn_of_other_sampler();
  TrainingSettings settings{window_, filter_, callbacks_.stop, callbacks_.progress, {}};
  if (plan_.takes_training) settings.image = &result_.training;
  if (integrator_->learning() && request_.load_training.empty()) {
    begin(RenderStage::kTraining);
    if (timed()) warn_of_long_training();
  }
  if (!train(scene_, request_, *integrator_, settings, result_.seconds)) return false;
  state_.budget = state_.group_budget = rounds_.budget();
  if (timed()) {
    begin(RenderStage::kTrial);
    const double before = watch_.seconds();
    plan_time_limit();
    if (stopped()) return false;
    result_.seconds.trial = watch_.seconds() - before;
  }
  for (bool first = true;; first = false) {
    double share = 0;
    for (size_t i = 0; i < plan_.phases.size(); ++i) {
      share += plan_.phases[i].share;
      if (!render_phase(i, first ? share : 1)) return false;
    }
    if (in_rounds() && next_round_fits()) {
      if (stopped()) return false;
      continue;
    }
    keep_choice();
    if (wants_more()) continue;
    if (rounds_.repeat()) {
      state_.budget = rounds_.budget();
      continue;
    }
    if (needs_estimate()) {
      keep_films_before_more();
      if (!estimate()) return false;
    }
    if (callbacks_.predicted && result_.predicted)
      callbacks_.predicted(request_.until_in_blocks
                               ? PredictedError{error_to_limit(), std::nullopt, result_.predicted->doubt}
                               : *result_.predicted);
    if (in_rounds() && has_time_for_another_image() && next_round_fits()) continue;
    if (in_rounds()) return true;
    const bool out_of_time = timed() && seconds_left(plan_.phases.size() - 1, 1) <= 0;
    if (!out_of_time && wants_more()) continue;
    const uint32_t limit = largest_budget(scene_, request_);
    const double error = out_of_time ? error_to_limit() : surely_at_most();
    if (request_.until > 0) result_.until_reached = error <= request_.until;
    if (result_.until_reached.value_or(true) || state_.budget >= limit || out_of_time) return true;
    rounds_.add(next_budget(state_.budget, error, request_.until, limit,
                            result_.predicted->doubt.empty() ? kMaxGrowth : kDoubtfulGrowth));
    state_.budget = rounds_.budget();
  }
}

/// Takes the goal that the caller may have raised; without a target error, true if it needs more samples.
bool PlanRun::wants_more() {
  if (!callbacks_.goal || timed()) return false;
  callbacks_.goal(request_);
  const uint32_t largest = largest_budget(scene_, request_);
  if (request_.until > 0 || state_.budget >= largest) return false;
  state_.budget = largest;
  return true;
}

double PlanRun::seconds_left(size_t phase, double share) {
  if (phase + 1 < plan_.phases.size()) return share * (request_.seconds - reserved_seconds_) - watch_.seconds();
  return request_.seconds - watch_.seconds() - estimate_seconds_.value_or(costs_.end);
}

bool PlanRun::render_phase(size_t index, double share) {
  const Phase& phase = plan_.phases[index];
  if (index == first_of_phase_.size()) begin_phase(phase);
  const std::span<Pass> passes = passes_of(index);
  if (passes.empty()) return false;  // interrupted before its films were created
  if (request_.until > 0) {
    state_.budget = rounds_.budget();  // an earlier call's film may have recorded it
    for (Pass& pass : state_.passes) pass.film.attributes[film_key::kBudgets] = rounds_.text();
  }
  if (lacks_auxiliary_images(index)) {
    take_first_samples(passes[0]);
    if (!stopped()) render_auxiliary_images();
  }
  state_.features = features();
  if (timed() && !in_rounds()) state_.seconds_left = seconds_left(index, share);
  set_targets(phase, passes.first(camera_passes(passes).size()));
  if (request_.resume && !timed() && request_.until == 0) check_earlier_samples(camera_passes(passes));
  if (passes.back().plan.light) set_light_target(*state_.integrator, camera_passes(state_.passes), passes.back());
  for (Pass& pass : passes) pass.count = pass.settings.spp.reached(pass.film);
  if (request_.resume && index == 0 && done_ == 0) tell_resumed(camera_passes(passes));
  if (index + 1 == plan_.phases.size() && !timed() && request_.until == 0) warn_of_other_samples(state_.budget);
  begin(RenderStage::kRendering);
  WaveLimits limits;
  if (timed() && !in_rounds()) limits.seconds_left = [this, index, share] { return seconds_left(index, share); };
  const uint64_t later = in_rounds() ? uint64_t{largest_budget(scene_, request_) - state_.budget} * n_pixels() : 0;
  if (callbacks_.progress)
    limits.progress = [this, later](uint64_t done, uint64_t total) {
      callbacks_.progress(done_ + done, done_ + total + later);
    };
  trace(passes, limits);
  return !stopped() || complete();
}

/// So that an interrupted render has a picture, even if auxiliary images take long.
void PlanRun::take_first_samples(Pass& pass) {
  if (camera_samples() > 0 || pass.settings.estimate) return;  // such a pass takes all samples of a pixel at once
  // If the time ends before the next ones, rounds have a sample for each group, and other passes need it.
  pass.settings.spp = timed() && !in_rounds() ? static_cast<uint32_t>(pass.film.groups()) : 1;
  pass.count = 0;
  begin(RenderStage::kRendering);
  WaveLimits limits;
  const uint64_t all = n_pixels() * (timed() ? largest_budget(scene_, request_) : state_.budget);
  if (callbacks_.progress)
    limits.progress = [this, all](uint64_t done, uint64_t total) { callbacks_.progress(done, std::max(all, total)); };
  trace(std::span(&pass, 1), limits);
}

void PlanRun::trace(std::span<Pass> passes, WaveLimits& limits) {
  limits.stop = callbacks_.stop;
  limits.wave = [this] { between_waves(); };
  limits.small_waves = callbacks_.small_waves && !timed();  // time must not end before each group has a sample
  limits.region = callbacks_.region;
  consistent_ = false;
  const Stopwatch watch;
  const double before = camera_samples();
  const uint64_t taken = render_passes(*scene_.scene, passes, limits);
  round_seconds_ += watch.seconds(), round_samples_ += camera_samples() - before;
  consistent_ = true;
  done_ += taken;
  unsaved_ = unsaved_ || taken > 0;
}

void PlanRun::set_targets(const Phase& phase, std::span<Pass> passes) {
  const auto has_few = [](const Pass& pass) {
    return !pass.settings.spp.is_map() && pass.settings.spp.largest() < static_cast<uint32_t>(pass.film.groups());
  };
  phase.set_targets(state_, passes);
  while (in_rounds() && state_.budget < largest_budget(scene_, request_) && std::ranges::any_of(passes, has_few)) {
    ++state_.budget;  // a resumed film has more groups than this time allows, or a small share of the samples
    phase.set_targets(state_, passes);
  }
}

void PlanRun::begin_phase(const Phase& phase) {
  first_of_phase_.push_back(state_.passes.size());
  if (phase.prepare) phase.prepare(state_);
  if (stopped()) return;
  std::vector<PassPlan> plans = phase.passes(state_);
  COVARY_CHECK(!plans.empty(), "a phase has passes");
  const bool is_last = first_of_phase_.size() == plan_.phases.size();
  if (plan_.traces_light && is_last) plans.push_back(light_pass_plan(plan_, plans));
  std::vector<PassPlan> all = plans;
  for (const Pass& pass : state_.passes) all.push_back(pass.plan);
  RenderMemory memory = render_memory(plan_, all, window_.width, window_.height, needs_aovs());
  memory.training = training_memory(scene_, request_);
  check_memory(memory, window_.width, window_.height);
  for (PassPlan& plan : plans) {
    if (plan.light) plan.groups = light_groups(plan_, std::span(state_.passes).subspan(first_of_phase_.back()));
    for (const Pass& other : state_.passes)
      COVARY_CHECK(other.plan.id() != plan.id() && (other.plan.sampling != plan.sampling ||
                                                    other.plan.number != plan.number || other.plan.light != plan.light),
                   "passes '" + other.plan.id() + "' and '" + plan.id() + "' of a plan have identities of their own");
    state_.passes.push_back(begin_pass(plan));
  }
}

Pass PlanRun::begin_pass(const PassPlan& plan) {
  Pass pass;
  pass.plan = plan;
  pass.integrator = state_.integrator;
  pass.settings.sampling = plan.sampling;
  const Sampler sampler = sampler_of(scene_, request_);
  pass.settings.sampler = plan.light ? Sampler::kIndependent : sampler;
  pass.settings.seed = request_.seed;
  pass.settings.pass = plan.light ? kLightPass + plan.number : plan.number;
  pass.settings.filter = filter_;
  pass.settings.estimate = plan.estimate;
  pass.path = pass_path(plan_, request_, plan);
  pass.film = Film(scene_.width, scene_.height, window_, plan.groups);
  if (plan.sample_variance) pass.film.keep_sample_variance();
  const std::string number = plan.number ? fmt::format("; pass {}", plan.number) : "";
  pass.film.attributes = request_.attributes;
  pass.film.attributes.insert_or_assign(film_key::kSeed, std::to_string(request_.seed));
  pass.film.attributes.insert_or_assign(film_key::kSampling, sampling_name(plan.sampling));
  pass.film.attributes.insert_or_assign(film_key::kSceneHash, scene_.content_hash);
  const LearningIntegrator* learning = state_.integrator->learning();
  pass.film.attributes.insert_or_assign(
      film_key::kSettings, (learning ? learning->settings_text() : state_.integrator->description()) + "; filter " +
                               filter_text(filter_) + number + plan.settings +
                               (sampler == Sampler::kSobol ? "; sampler sobol" : ""));
  if (learning) pass.film.attributes.insert_or_assign(film_key::kTraining, learning->training_text());
  pass.film.attributes.insert_or_assign(film_key::kComplete, "false");
  if (plan.light) pass.film.attributes.insert_or_assign(film_key::kLightPaths, std::to_string(kBundlePaths));
  if (!plan.estimator.empty()) pass.film.attributes.insert_or_assign("estimator", plan.estimator);
  take_film_on_disk(request_, callbacks_.warning, pass);
  result_.seconds.processor += pass.processor_seconds;  // of earlier calls
  if (const auto budgets = pass.film.attributes.find(film_key::kBudgets); budgets != pass.film.attributes.end())
    rounds_.take(budgets->second, largest_budget(scene_, request_), pass.path);
  pass.settings.groups = pass.film.groups();
  unsaved_ = unsaved_ || !request_.passes.empty();
  return pass;
}

void PlanRun::between_waves() {
  if (callbacks_.wave) callbacks_.wave(state_.passes);
  if (request_.checkpoint_seconds <= 0 || since_checkpoint_.seconds() < request_.checkpoint_seconds) return;
  unsaved_ = true;
  try_to_keep_films(false, "rendering continues, and the next checkpoint tries again");
}

/// Pixels with more samples than asked for stay as they are. An interrupted render would end with unequal numbers.
void PlanRun::check_earlier_samples(std::span<const Pass> passes) const {
  for (const Pass& pass : passes) {
    if (pass.settings.spp.is_map() || pass.film.counts().empty()) continue;
    const auto [fewest, most] = std::ranges::minmax(pass.film.counts());
    if (most > pass.settings.spp.largest() && fewest < most)
      throw Error(
          ErrorCode::kInput,
          fmt::format("`resume`: '{}' was interrupted with {} to {} samples per pixel, this command asks for {}; "
                      "as many as before, or more, continue it, and `overwrite` replaces it",
                      pass.path, fewest, most, pass.settings.spp.largest()));
  }
}

void PlanRun::warn_of_other_samples(uint32_t asked) const {
  double planned = 0;
  for (const Pass& pass : camera_passes(state_.passes)) {
    if (pass.settings.spp.is_map()) return;  // its counts are approximate, or limited by other options
    planned += pass.settings.spp.largest();
  }
  if (planned != asked && callbacks_.warning)
    callbacks_.warning(fmt::format("{:g} samples per pixel instead of {}: each of {} groups needs one in every pass",
                                   planned, asked, state_.passes[0].film.groups()));
}

}  // namespace covary
