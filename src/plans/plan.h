// SPDX-License-Identifier: Apache-2.0
// A plan says what a method renders: phases one after the other, each with passes that advance together, and how the
// image is made of the films. A phase may read whatever earlier phases left: films, numbers of samples made of them, a
// trained integrator. render() in plans/render.h carries plans out.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "estimators/estimator.h"
#include "film/film.h"
#include "io/load_scene.h"
#include "passes/integrator.h"
#include "passes/render_pass.h"

namespace covary {

struct RenderRequest;

/// What a plan says of one pass. Name and number are its identity: they are in the name of its file, and the number
/// enters its random numbers. No two passes of a plan have the same identity, or both sampling and number in common.
struct PassPlan {
  std::string name;     ///< letters, digits, '_'
  uint32_t number = 0;  ///< PassSettings::pass
  Sampling sampling = Sampling::kIndependent;
  int groups = 1;  ///< of the film
  /// The number of groups follows from the samples, or from the speed; a film that is continued may have any number
  /// from this on. 0: exactly `groups`.
  int fewest_groups = 0;
  bool sample_variance = false;  ///< the film keeps the variance of samples
  PixelEstimate estimate;        ///< PassSettings::estimate
  /// A light pass (passes/light_pass.h): the film's samples are bundles of light paths, and the number in its
  /// random numbers is kLightPass + number.
  bool light = false;
  std::string
      settings;  ///< of the pass, added to the integrator's in the film's attribute: all that changes its samples
  std::string estimator;  ///< attribute of the film where the pass itself makes the image; may be empty

  /// "crn", or with a number other than 0 "crn-2".
  std::string id() const { return number == 0 ? name : name + "-" + std::to_string(number); }
};

/// What a trial of common random numbers found (split_plan.h): relMSE of denoised images of equally many samples, by
/// held-out ones, which may be negative.
struct SplitTrial {
  double samples = 0;  ///< per pixel, of both passes; 0: there was no trial
  double independent = 0, with_crn = 0;
  bool crn_wins = false;
};

/// A pass while it is rendered.
struct Pass {
  PassPlan plan;
  std::shared_ptr<const Integrator> integrator;
  PassSettings settings;  ///< spp: samples per pixel to reach
  Film film;
  std::string path;  ///< the file that keeps the film; empty where none does
  /// The file is this render's alone, and goes once its image is written; otherwise it is kept.
  bool temporary = false;
  uint32_t count = 0;  ///< samples that every pixel has which is to have so many
  /// Of a light pass: the samples that keep step with the camera's, which may be more than a film can hold where only
  /// time ends the render.
  double wanted = 0;
  bool misses_error = false;        ///< the plan was asked for an error that needs more samples than it may take
  std::optional<SplitTrial> trial;  ///< of split_plan.h: what decided on its samples
  PassResult result;  ///< of all calls together, earlier ones included where a folder of passes keeps them
};

/// What phases read.
struct PlanState {
  const LoadedScene& scene;
  const RenderRequest& request;
  const std::atomic<bool>* stop;  ///< may be null; prepare() returns soon once it is true
  /// Traces the passes that are begun from now on. A phase may put another one in its place, such as a trained one,
  /// whose description() then distinguishes the films.
  std::shared_ptr<const Integrator> integrator;
  uint32_t budget = 0;  ///< samples per pixel of all passes together that are wanted now; grows towards a wanted error
  uint32_t group_budget = 0;  ///< the budget that decides how many groups there are; stays
  /// With a limit of time, what is left of it when a phase's targets are set, for all that follows.
  std::optional<double> seconds_left;
  std::vector<Pass> passes;  ///< of this phase and all before it, in the order of the plan
  Guides guides;             ///< of the whole window, for the targets of the last phase, where Plan::reads_guides

  /// The pass of this name and number. Throws Error(kInternal) where none has begun.
  const Pass& pass(const std::string& name, uint32_t number = 0) const;
};

struct Phase {
  /// Part of the time limit that the phase may use; the parts of a plan add up to 1.
  double share = 1;
  /// Optional work before the phase's films are made, such as a training. Called once.
  std::function<void(PlanState&)> prepare;
  /// The passes, at least one. Called once, after prepare().
  std::function<std::vector<PassPlan>(const PlanState&)> passes;
  /// Says how many samples each pass of the phase is to have for state.budget: settings.spp, a number or a map.
  /// Called before the phase is rendered, again each time the budget has grown.
  std::function<void(const PlanState&, std::span<Pass>)> set_targets;
};

/// What an estimate may read beside the films, of its rows.
struct Beside {
  Guides guides;              ///< where Plan::reads_guides
  std::vector<Layer> layers;  ///< where Plan::splits_layers; empty where none were asked for
};

/// What render() makes of a plan whose integrator traces light: a pass "light" beside those of the last phase, which
/// advances with them, and whose film is added to the image (light_plan.h). Phases and estimate() see the passes of
/// camera samples alone.
struct Plan {
  std::string name;       ///< of the estimator, for messages
  std::string estimator;  ///< the same with its options, for the image's attribute
  std::string network;    ///< Estimator::network
  std::vector<Phase> phases;
  /// The image of rows first_row … first_row + n_rows - 1 of the films so far. Its cost depends on the size, not on
  /// counts.
  std::function<EstimatorResult(std::span<const Pass>, int first_row, int n_rows, const Beside& beside)> estimate;
  EstimatorMemory estimate_memory;  ///< that estimate() takes beside the films
  bool takes_unfinished = false;    ///< estimate() works where pixels of a film still have no samples
  bool reads_guides = false;        ///< estimate() reads albedo and normal, which are rendered for it
  bool splits_layers = false;       ///< estimate() makes EstimatorResult::layers of Beside::layers
  bool film_is_image = false;       ///< the film of the one pass is the result; estimate() only serves its error
  bool takes_training = false;      ///< samples of the integrator's training join the image
  bool has_crn_pass = false;        ///< some pass takes common random numbers
  bool traces_light = false;        ///< set by render(): there is a light pass
  bool predicts_error = false;      ///< estimate() gives a standard error
  uint32_t reliable_samples = 0;    ///< Estimator::reliable_samples
  bool fixed_samples = false;       ///< the number of samples must be known before: no limits of time or error
  /// With a time limit, the speed is measured before the passes begin, so that there are no more groups than samples.
  bool groups_follow_speed = false;
};

/// The passes without the light pass, which is the last where there is one.
std::span<const Pass> camera_passes(std::span<const Pass> passes);
/// The light pass, or null.
const Pass* light_pass(std::span<const Pass> passes);

}  // namespace covary
