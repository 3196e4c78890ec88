// SPDX-License-Identifier: Apache-2.0
// Implements render(): executes a plan once. Only used in plans/.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "core/stopwatch.h"
#include "plans/budget.h"
#include "plans/pass_waves.h"
#include "plans/render.h"
#include "plans/time_budget.h"

namespace covary {

/// Phases and files of a render are in plan_run.cpp, the image of its films in plan_run_image.cpp, and the trials
/// before a time limit is spent in time_trial.cpp.
class PlanRun {
 public:
  PlanRun(const LoadedScene& scene, const Plan& plan, const RenderRequest& request, const RenderCallbacks& callbacks);

  RenderResult run();

 private:
  /// Renders and estimates, once or until the predicted error is small enough. False if interrupted.
  bool render_to_limits();
  /// Renders a phase, until `share` of the time limit is used. False if interrupted.
  bool render_phase(size_t index, double share);
  double seconds_left(size_t phase, double share);
  void take_first_samples(Pass& pass);
  void trace(std::span<Pass> passes, WaveLimits& limits);
  /// Measures what the parts of the render take, warns if even the least takes too long, and sets the first budget.
  void plan_time_limit();
  void warn_of_long_training() const;
  std::vector<PassPlan> passes_with(uint32_t group_budget) const;
  TimeCosts measure_costs();
  double time_of_end(double seconds_per_sample);
  double end_of_band(int n_rows, std::span<const PassPlan> plans);
  /// Whether the time suffices for more samples, for which it sets the budget.
  bool next_round_fits();
  bool has_time_for_another_image();
  /// How often samples are traced: again for images of their parts.
  double times_traced() const { return 1.0 + request_.splits_layers() + request_.path_lengths; }
  void keep_choice();
  void begin_phase(const Phase& phase);
  /// With in_rounds(), of a budget that gives each group of each pass a sample.
  void set_targets(const Phase& phase, std::span<Pass> passes);
  Pass begin_pass(const PassPlan& plan);
  /// `layers`: films of parts of the last pass's samples.
  EstimatorResult estimate_rows(int first_row, int n_rows, std::span<const Film> layers = {}) const;
  void between_waves();
  void keep_films_before_more();
  bool try_to_keep_films(bool complete, const char* then);  // false: a warning gave the reason
  void keep_films_of_failure() noexcept;
  std::span<Pass> films() { return result_.passes.empty() ? state_.passes : result_.passes; }
  void warn_of_other_samples(uint32_t asked) const;
  void check_earlier_samples(std::span<const Pass> passes) const;
  void tell_resumed(std::span<const Pass> passes);
  void warn_of_missing_light() const;
  void warn_of_other_sampler() const;
  bool estimate();
  bool wants_more();
  bool lacks_auxiliary_images(size_t phase) const {
    return phase + 1 == plan_.phases.size() && needs_aovs() && result_.aovs.empty();
  }
  void render_auxiliary_images();
  void trace_layers();
  void add_path_lengths();
  void write_files();

  void begin(RenderStage stage) const {
    if (callbacks_.stage) callbacks_.stage(stage);
  }
  bool has_training() const { return !result_.training.mean.data.empty(); }
  uint64_t n_pixels() const { return static_cast<uint64_t>(window_.width) * static_cast<uint64_t>(window_.height); }
  bool timed() const { return request_.seconds > 0; }
  /// A time limit is spent in rounds, each of the same number of samples in all pixels.
  bool in_rounds() const { return timed() && plan_.phases.size() == 1 && request_.until == 0; }
  double camera_samples() const {
    double samples = 0;
    for (const Pass& pass : camera_passes(state_.passes)) samples += pass.film.mean_count();
    return samples;
  }
  /// The error that RenderRequest::until limits.
  double error_to_limit() const {
    return request_.until_in_blocks ? result_.predicted_blocks : result_.predicted->relmse;
  }
  /// The same, or after few samples the upper end of its interval, so that a render does not end by chance; infinite if
  /// there is none.
  double surely_at_most() const {
    if (state_.budget >= first_budget(scene_, request_)) return error_to_limit();
    const PredictedError& predicted = *result_.predicted;
    if (!predicted.bounds) return std::numeric_limits<double>::infinity();
    return error_to_limit() * (predicted.bounds->high / predicted.relmse);
  }
  /// A film that is the image needs no estimate, except for its error, which its groups tell, or for layers.
  bool needs_estimate() const {
    if (request_.films_only) return false;
    const bool has_error = plan_.method->predicts_error && state_.passes[0].film.groups() > 1;
    return !plan_.makes_film() || has_error || request_.until > 0 || request_.splits_layers();
  }
  /// Features of the whole window; empty if the plan reads none or they do not exist.
  Features features() const { return plan_.method->reads_features ? features_among(result_.aovs) : Features(); }
  bool needs_aovs() const { return request_.aovs || request_.alpha || plan_.method->reads_features; }
  bool stopped() const { return callbacks_.stop && callbacks_.stop->load(); }
  /// The passes of every phase exist.
  bool all_begun() const {
    return first_of_phase_.size() == plan_.phases.size() && first_of_phase_.back() < state_.passes.size();
  }
  /// All passes have their target samples.
  bool complete() const {
    return all_begun() && std::all_of(state_.passes.begin(), state_.passes.end(),
                                      [](const Pass& p) { return p.count >= p.settings.spp.largest(); });
  }
  /// Every group of every pixel has samples, so an estimator can work.
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
  RenderRequest request_;  // the goal may be raised
  const RenderCallbacks& callbacks_;
  const CropWindow window_;
  const FilterSettings filter_;
  const std::shared_ptr<Integrator> integrator_;  // only for this render
  PlanState state_;
  ErrorRounds rounds_;                  // if there is a target error
  std::vector<size_t> first_of_phase_;  // index of the first pass of each phase that has begun
  RenderResult result_;
  std::shared_ptr<Integrator> of_layers_;  // with RenderRequest::splits_layers(), like the two below
  std::vector<std::string> layer_names_;
  std::vector<Film> layers_;  // with these names; empty until traced
  uint64_t done_ = 0;         // samples of this call, of earlier phases and rounds
  Stopwatch watch_, since_checkpoint_;
  bool consistent_ = true;                        // the films are in the state between two waves
  bool unsaved_ = false;                          // they have samples that have not been written
  double estimate_stopped_after_ = 0;             // seconds
  std::optional<double> estimate_seconds_;        // of the next estimate
  TimeCosts costs_;                               // with a time limit
  uint32_t aov_samples_;                          // RenderRequest::aov_samples, or fewer
  double round_seconds_ = 0, round_samples_ = 0;  // of all rounds of this call
  double reserved_seconds_ = 0;                   // that earlier phases leave: images, files, auxiliary images
};

}  // namespace covary
