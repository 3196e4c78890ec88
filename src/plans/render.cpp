// SPDX-License-Identifier: Apache-2.0
#include "plans/render.h"

#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <filesystem>
#include <utility>

#include "combine/combine.h"
#include "core/error.h"
#include "core/stop.h"
#include "core/stopwatch.h"
#include "film/splat_layer.h"
#include "integrators/aov.h"
#include "integrators/light_pass.h"
#include "integrators/path_length_images.h"
#include "integrators/training.h"
#include "plans/budget.h"
#include "plans/error_rounds.h"
#include "plans/folder_lock.h"
#include "plans/integrator_choice.h"
#include "plans/light_plan.h"
#include "plans/memory.h"
#include "plans/pass_files.h"
#include "plans/pass_waves.h"
#include "plans/result_files.h"
#include "plans/training_stage.h"
#include "risk/predicted_error.h"

namespace covary {
namespace {

namespace fs = std::filesystem;

/// Largest factor from one budget to the next towards a wanted error; and where the predicted error is unreliable, so
/// that one that is far too large does not cost that many samples before it is seen again.
constexpr double kMostGrowth = 4, kDoubtfulGrowth = 2;
constexpr int kTrialRows = 64;        // at least, where the time of the estimate is found out
constexpr uint32_t kAovSamples = 16;  // per pixel of auxiliary images
/// Seconds of work after which films that nobody asked for are worth writing before the image is made of them.
constexpr double kWorthKeeping = 10;
constexpr double kEstimateOfInterrupted = 0.5;  // seconds that it may take; after these the image is the mean

std::string filter_text(const FilterSettings& filter) {
  switch (filter.kind) {
    case FilterKind::kBox:
      return fmt::format("box radius={}", filter.radius);
    case FilterKind::kTent:
      return fmt::format("tent radius={}", filter.radius);
    case FilterKind::kGaussian:
      return fmt::format("gaussian radius={} stddev={}", filter.radius, filter.stddev);
  }
  throw Error(ErrorCode::kInternal, "unknown reconstruction filter");
}

void check(const LoadedScene& scene, const Plan& plan, const RenderRequest& request) {
  const auto usage = [](const std::string& message) { throw Error(ErrorCode::kUsage, message); };
  if (request.spp && (*request.spp < 1 || *request.spp > kMaxBudget))
    usage(fmt::format("{} samples per pixel; expected are 1 to {}", *request.spp, kMaxBudget));
  if (plan.fixed_samples && (request.seconds > 0 || request.until > 0))
    usage(plan.name + " needs the number of samples to be known before, so there can be no limit of time or error");
  if (request.path_lengths && !integrator_of(scene).longest_path())
    usage("images by the number of edges need an integrator that knows them, such as controlled-path");
  if (request.until > 0 && !plan.predicts_error) usage(plan.name + " does not estimate its error");
}

/// Carries a plan out, once.
class PlanRun {
 public:
  PlanRun(const LoadedScene& scene, const Plan& plan, const RenderRequest& request, const RenderCallbacks& callbacks)
      : scene_(scene),
        plan_(plan),
        request_(request),
        callbacks_(callbacks),
        window_(window_of(scene, request)),
        filter_(request.filter.value_or(scene.filter)),
        integrator_(prepared_integrator(scene, plan, request)),
        state_{scene, request, callbacks.stop, integrator_, 0, 0, {}},
        rounds_(first_budget(scene, request)) {
    plan_.traces_light = has_light_pass(scene, plan);
  }

  RenderResult run();

 private:
  /// Renders and estimates, once or until the predicted error is small enough. False when interrupted.
  bool render_to_limits();
  /// Renders a phase, until `share` of the time limit is used. False when interrupted.
  bool render_phase(size_t index, double share);
  double seconds_left(size_t phase, double share);
  void begin_phase(const Phase& phase);
  Pass begin_pass(const PassPlan& plan);
  EstimatorResult estimate_rows(int first_row, int n_rows) const;
  void between_waves();
  void keep_films_before_more();
  bool try_to_keep_films(bool complete, const char* then);  // false: a warning says why
  void keep_films_of_failure() noexcept;
  std::span<Pass> films() { return result_.passes.empty() ? state_.passes : result_.passes; }
  void warn_of_other_samples(uint32_t asked) const;
  void warn_of_missing_light() const;
  void warn_of_other_sampler() const;
  bool estimate();
  double time_estimate();
  void render_auxiliary_images();
  void add_path_lengths();
  void write_files();

  void begin(RenderStage stage) const {
    if (callbacks_.stage) callbacks_.stage(stage);
  }
  bool has_training() const { return !result_.training.mean.data.empty(); }
  bool timed() const { return request_.seconds > 0; }
  /// What RenderRequest::until is about.
  double error_to_limit() const {
    return request_.until_in_blocks ? *result_.predicted_blocks : *result_.predicted_relmse;
  }
  /// The film is the image, and its groups tell its error.
  bool film_has_errors() const {
    return plan_.film_is_image && plan_.predicts_error && state_.passes[0].film.groups() > 1;
  }
  bool needs_aovs() const { return request_.aovs || plan_.reads_guides; }
  bool stopped() const { return callbacks_.stop && callbacks_.stop->load(); }
  /// The passes of every phase are there.
  bool all_begun() const {
    return first_of_phase_.size() == plan_.phases.size() && first_of_phase_.back() < state_.passes.size();
  }
  /// All passes have the samples they should.
  bool complete() const {
    return all_begun() && std::all_of(state_.passes.begin(), state_.passes.end(),
                                      [](const Pass& p) { return p.count >= p.settings.spp.largest(); });
  }
  /// Every group of every pixel has samples, so that an estimator can work.
  bool can_estimate() const {
    return all_begun() && std::all_of(state_.passes.begin(), state_.passes.end(), [this](const Pass& p) {
             return plan_.takes_unfinished ||
                    std::all_of(p.film.counts().begin(), p.film.counts().end(),
                                [T = static_cast<uint32_t>(p.film.groups())](uint32_t n) { return n >= T; });
           });
  }
  std::span<Pass> passes_of(size_t phase) {
    const size_t end = phase + 1 < first_of_phase_.size() ? first_of_phase_[phase + 1] : state_.passes.size();
    return std::span(state_.passes).subspan(first_of_phase_[phase], end - first_of_phase_[phase]);
  }

  const LoadedScene& scene_;
  Plan plan_;
  const RenderRequest& request_;
  const RenderCallbacks& callbacks_;
  const CropWindow window_;
  const FilterSettings filter_;
  const std::shared_ptr<Integrator> integrator_;  // of this render alone
  PlanState state_;
  ErrorRounds rounds_;                  // where an error is wanted
  std::vector<size_t> first_of_phase_;  // index of the first pass of each phase that has begun
  RenderResult result_;
  uint64_t done_ = 0;  // samples of this call, of earlier phases and rounds
  Stopwatch watch_, since_checkpoint_;
  bool consistent_ = true;                  // the films are as they were between two waves
  bool unsaved_ = false;                    // they have samples that are on no disk
  std::optional<double> estimate_seconds_;  // what the next estimate takes
};

RenderResult PlanRun::run() {
  std::optional<FolderLock> lock;
  if (!request_.passes.empty()) lock.emplace(request_.passes);
  check_earlier_films(plan_, request_);
  try {
    result_.interrupted = !render_to_limits();
    result_.complete = complete();
    if (result_.interrupted && can_estimate() && (!plan_.film_is_image || film_has_errors())) {
      keep_films_before_more();
      estimate();
    }
    const Stopwatch watch;
    write_files();
    result_.seconds.write += watch.seconds();
  } catch (...) {
    keep_films_of_failure();
    throw;
  }
  return std::move(result_);
}

bool PlanRun::try_to_keep_films(bool complete, const char* then) {
  const Stopwatch watch;
  since_checkpoint_ = Stopwatch();
  try {
    save_passes(request_, films(), complete);
    unsaved_ = false;
  } catch (const std::exception& error) {
    if (callbacks_.warning) callbacks_.warning(fmt::format("the films could not be kept: {}; {}", error.what(), then));
  }
  result_.seconds.write += watch.seconds();
  return !unsaved_;
}

/// Films that have cost time are on disk before anything else is done with them.
void PlanRun::keep_films_before_more() {
  const bool asked = !request_.passes.empty();
  if (unsaved_ && (asked || since_checkpoint_.seconds() > kWorthKeeping))
    try_to_keep_films(!stopped(), "the image is made nevertheless");
}

/// After an error that came when all films were whole.
void PlanRun::keep_films_of_failure() noexcept {
  if (!consistent_ || !unsaved_ || done_ == 0 || films().empty() || films()[0].path.empty()) return;
  try {
    if (try_to_keep_films(false, "they are lost") && callbacks_.warning)
      callbacks_.warning(
          output_is_film(plan_, request_)
              ? fmt::format("the film is kept in '{}'; --resume continues it", request_.output)
              : fmt::format("the films are kept in '{}'; --resume continues them", passes_folder(request_).string()));
  } catch (...) {  // no memory for the text of a warning
  }
}

void PlanRun::write_files() {
  begin(RenderStage::kWriting);
  const bool is_film = output_is_film(plan_, request_);
  result_.integrator = state_.integrator;
  result_.passes = std::move(state_.passes);
  if (result_.interrupted && result_.samples_per_pixel() == 0) return;
  if (plan_.film_is_image && has_training())
    result_.image.estimate = with_training(result_.passes[0].film, result_.training);
  if (request_.path_lengths && !result_.interrupted) {
    keep_films_before_more();
    add_path_lengths();
    result_.interrupted = stopped();
  }
  std::exception_ptr failure;
  if (unsaved_ && (!request_.passes.empty() || (result_.interrupted && !is_film))) {
    try {
      save_passes(request_, result_.passes, !result_.interrupted);
      unsaved_ = false;
    } catch (const Error&) {  // the image, which is smaller, may still find room
      failure = std::current_exception();
    }
  }
  write_result_files(plan_, request_, result_);
  if (failure) std::rethrow_exception(failure);
  unsaved_ = unsaved_ && !is_film;
  if (result_.interrupted)
    result_.kept = is_film ? request_.output : passes_folder(request_).string();
  else
    remove_passes(request_, result_.passes);
}

void PlanRun::add_path_lengths() {
  const Pass& pass = camera_passes(result_.passes).back();
  PassSettings settings = pass.settings;
  settings.stop = callbacks_.stop;
  std::vector<Image> images = path_length_images(*scene_.scene, *pass.integrator, settings, pass.film);
  for (size_t i = 0; i < images.size(); ++i) result_.aovs[fmt::format("Edges{:02}", i + 1)] = std::move(images[i]);
}

void PlanRun::warn_of_missing_light() const {
  if (plan_.traces_light || !scene_.has_delta_lights_and_surfaces || !callbacks_.warning ||
      !integrator_->light_tracing())
    return;
  callbacks_.warning(
      "without light tracing the image lacks what mirrors and glass cast of lights that are a point or a direction");
}

void PlanRun::warn_of_other_sampler() const {
  const std::string& type = scene_.sampler_type;
  const bool is_other = sampler_of(scene_, request_) == Sampler::kSobol && type != "sobol";
  if (request_.sampler || !callbacks_.warning || !is_other) return;
  callbacks_.warning(fmt::format("the scene's sampler '{}' is rendered as 'sobol' (--sampler)", type));
}

bool PlanRun::render_to_limits() {
  warn_of_missing_light();
  warn_of_other_sampler();
  TrainingSettings settings{window_, filter_, callbacks_.stop, callbacks_.progress, {}};
  if (plan_.takes_training) settings.image = &result_.training;
  if (integrator_->learning() && request_.load_training.empty()) begin(RenderStage::kTraining);
  if (!train(scene_, request_, *integrator_, settings, result_.seconds)) return false;
  const uint32_t limit = largest_budget(scene_, request_);
  state_.budget = state_.group_budget = rounds_.budget();
  if (timed() && plan_.groups_follow_speed) {
    // What half of the time is enough for, so that no more groups are begun than can be filled.
    const double samples =
        0.5 * request_.seconds * samples_per_second(scene_, *state_.integrator, filter_, window_, callbacks_.stop);
    state_.group_budget =
        static_cast<uint32_t>(std::min<double>(state_.budget, samples / window_.width / window_.height));
  }
  if (timed()) result_.seconds.trial = watch_.seconds();
  for (bool first = true;; first = false) {
    double share = 0;
    for (size_t i = 0; i < plan_.phases.size(); ++i) {
      share += plan_.phases[i].share;
      if (!render_phase(i, first ? share : 1)) return false;
    }
    if (rounds_.repeat()) {
      state_.budget = rounds_.budget();
      continue;
    }
    if (!plan_.film_is_image || film_has_errors() || request_.until > 0) {
      keep_films_before_more();
      if (!estimate()) return false;
    }
    result_.seconds.limited = watch_.seconds();
    if (request_.until > 0) {
      result_.until_reached = error_to_limit() <= request_.until;
      if (callbacks_.predicted) callbacks_.predicted(error_to_limit());
    }
    const bool out_of_time = timed() && seconds_left(plan_.phases.size() - 1, 1) <= 0;
    if (result_.until_reached.value_or(true) || state_.budget >= limit || out_of_time) return true;
    rounds_.add(next_budget(state_.budget, error_to_limit(), request_.until, limit,
                            result_.prediction_doubt.empty() ? kMostGrowth : kDoubtfulGrowth));
    state_.budget = rounds_.budget();
  }
}

double PlanRun::seconds_left(size_t phase, double share) {
  if (phase + 1 < plan_.phases.size()) return share * request_.seconds - watch_.seconds();
  if (!estimate_seconds_) estimate_seconds_ = time_estimate();
  return request_.seconds - watch_.seconds() - *estimate_seconds_;
}

bool PlanRun::render_phase(size_t index, double share) {
  const Phase& phase = plan_.phases[index];
  if (index == first_of_phase_.size()) begin_phase(phase);
  const std::span<Pass> passes = passes_of(index);
  if (passes.empty()) return false;  // interrupted before its films were made
  if (index + 1 == plan_.phases.size() && needs_aovs() && result_.aovs.empty()) render_auxiliary_images();
  if (timed()) state_.seconds_left = request_.seconds - watch_.seconds();
  if (request_.until > 0) {
    state_.budget = rounds_.budget();  // a film may have told of an earlier call's
    for (Pass& pass : state_.passes) pass.film.attributes[film_key::kBudgets] = rounds_.text();
  }
  phase.set_targets(state_, passes.first(camera_passes(passes).size()));
  if (passes.back().plan.light) set_light_target(*state_.integrator, camera_passes(state_.passes), passes.back());
  for (Pass& pass : passes) pass.count = pass.settings.spp.reached(pass.film);
  if (index + 1 == plan_.phases.size() && !timed() && request_.until == 0) warn_of_other_samples(state_.budget);
  begin(RenderStage::kRendering);
  WaveLimits limits;
  if (timed()) limits.seconds_left = [this, index, share] { return seconds_left(index, share); };
  limits.stop = callbacks_.stop;
  if (callbacks_.progress)
    limits.progress = [this](uint64_t done, uint64_t total) { callbacks_.progress(done_ + done, done_ + total); };
  limits.wave = [this] { between_waves(); };
  consistent_ = false;
  const uint64_t taken = render_passes(*scene_.scene, passes, limits);
  consistent_ = true;
  done_ += taken;
  unsaved_ = unsaved_ || taken > 0;
  return !stopped() || complete();
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
  memory.training = training_memory(scene_);
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
  pass.settings.crn_part = request_.crn_part;
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
  pass.film.attributes.insert_or_assign(film_key::kSampling, sampling_name(plan.sampling, request_.crn_part));
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
  take_film_on_disk(plan_, request_, callbacks_.warning, pass);
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
  try_to_keep_films(false, "rendering goes on, and the next checkpoint tries again");
}

void PlanRun::warn_of_other_samples(uint32_t asked) const {
  double planned = 0;
  for (const Pass& pass : camera_passes(state_.passes)) {
    if (pass.settings.spp.is_map()) return;  // its numbers are about what was asked for, or limited by other options
    planned += pass.settings.spp.largest();
  }
  if (planned != asked && callbacks_.warning)
    callbacks_.warning(fmt::format("{:g} samples per pixel instead of {}: each of {} groups needs one in every pass",
                                   planned, asked, state_.passes[0].film.groups()));
}

EstimatorResult PlanRun::estimate_rows(int first_row, int n_rows) const {
  Image albedo, normal;
  Guides guides;
  if (plan_.reads_guides && !result_.aovs.empty()) {  // empty where the render was stopped before
    albedo = rows_of(result_.aovs.at("Albedo"), first_row, n_rows);
    normal = rows_of(result_.aovs.at("N"), first_row, n_rows);
    guides = {&albedo, &normal};
  }
  EstimatorResult image = plan_.estimate(camera_passes(state_.passes), first_row, n_rows, guides);
  const Pass* light = light_pass(state_.passes);
  const GroupedImage light_rows = light ? rows_of(light->film, first_row, n_rows) : GroupedImage{};
  finish(image, light ? &light_rows : nullptr);
  if (has_training()) add_training(state_.passes[0].film, result_.training, first_row, image);
  return image;
}

/// False when interrupted; of a render that was interrupted before, when it takes too long.
bool PlanRun::estimate() {
  begin(RenderStage::kEstimating);
  const Stopwatch watch;
  const auto ends = [&] { return result_.interrupted ? watch.seconds() > kEstimateOfInterrupted : stopped(); };
  EstimatorResult image;
  result_.image = {};
  result_.predicted_relmse.reset(), result_.predicted_blocks.reset(), result_.prediction_doubt.clear();
  if (!run_stoppable(ends, [&] { image = estimate_rows(0, window_.height); })) return false;
  if (!image.std_error.data.empty()) {
    result_.predicted_relmse = predicted_relmse(image);
    result_.predicted_blocks = predicted_blocks(image);
    double samples = 0;
    for (const Pass& pass : camera_passes(films())) samples += pass.film.mean_count();
    result_.prediction_doubt = doubt_of_prediction(image, samples, plan_.reliable_samples);
  }
  if (request_.until > 0 && !result_.predicted_relmse)
    throw Error(ErrorCode::kUsage, "an error can only be predicted from 2 or more groups");
  if (plan_.film_is_image)
    result_.image.std_error = std::move(image.std_error);
  else
    result_.image = std::move(image);
  estimate_seconds_ = watch.seconds();
  result_.seconds.estimate += *estimate_seconds_;
  return true;
}

/// Seconds that the estimate will take, from a trial on rows in the middle: it depends on sizes, not on samples.
double PlanRun::time_estimate() {
  if (plan_.film_is_image) return 0;  // a mean
  const Stopwatch watch;
  const int height = window_.height, n_rows = std::min(height, std::max(kTrialRows, height / 8));
  run_stoppable(callbacks_.stop, [&] { estimate_rows((height - n_rows) / 2, n_rows); });
  const double seconds = watch.seconds();
  result_.seconds.trial += seconds;
  return seconds * height / n_rows;
}

void PlanRun::render_auxiliary_images() {
  const Stopwatch watch;
  Pass& last = state_.passes[camera_passes(state_.passes).size() - 1];
  render_aovs(*scene_.scene, last.settings, kAovSamples, last.film, callbacks_.stop);
  result_.aovs = std::exchange(last.film.aovs, {});
  result_.seconds.auxiliary = watch.seconds();
}

}  // namespace

const Pass& PlanState::pass(const std::string& name, uint32_t number) const {
  for (const Pass& pass : passes)
    if (pass.plan.name == name && pass.plan.number == number) return pass;
  throw Error(ErrorCode::kInternal, fmt::format("no pass {} {} has begun", name, number));
}

Image RenderResult::picture() const { return image.estimate.data.empty() ? preview_of(passes) : image.estimate; }

Sampler sampler_of(const LoadedScene& scene, const RenderRequest& request) {
  const bool is_independent = scene.sampler_type.empty() || scene.sampler_type == "independent";
  return request.sampler.value_or(is_independent ? Sampler::kIndependent : Sampler::kSobol);
}

RenderResult render(const LoadedScene& scene, const Plan& plan, const RenderRequest& request,
                    const RenderCallbacks& callbacks) {
  check(scene, plan, request);
  return PlanRun(scene, plan, request, callbacks).run();
}

Image preview_of(std::span<const Pass> passes) {
  if (passes.empty()) return {};
  const std::span<const Pass> cameras = camera_passes(passes);
  const Pass* light = light_pass(passes);
  Image image = cameras[0].film.mean_image();
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      double samples = cameras[0].film.count(x, y);
      for (const Pass& pass : cameras.subspan(1)) {
        const Spectrum next = pass.film.mean(x, y);
        samples += pass.film.count(x, y);
        const auto part = static_cast<float>(pass.film.count(x, y) / std::max(samples, 1.0));
        for (int c = 0; c < 3; ++c) image.pixel(x, y)[c] += part * (next[c] - image.pixel(x, y)[c]);
      }
      const Spectrum splats = light ? light->film.mean(x, y) : Spectrum(0);
      for (int c = 0; c < 3; ++c) image.pixel(x, y)[c] += splats[c];
    }
  return image;
}

}  // namespace covary
