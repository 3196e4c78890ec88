// SPDX-License-Identifier: Apache-2.0
// A plan is what a method renders: successive phases, each with passes that advance together, and the computation of
// the image from their films. A phase may read results of earlier phases: films, sample counts derived from them, a
// trained integrator. render() in plans/render.h executes plans.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "estimators/method.h"
#include "film/film.h"
#include "io/load_scene.h"
#include "passes/integrator.h"
#include "passes/render_pass.h"

namespace covary {

struct RenderRequest;

/// One pass of a plan. Name and number are its identity: the file name has both, and the number enters its random
/// numbers. No two passes of a plan have the same identity, or the same sampling and number.
struct PassPlan {
  std::string name;     ///< letters, digits, '_'
  uint32_t number = 0;  ///< PassSettings::pass
  Sampling sampling = Sampling::kIndependent;
  int groups = 1;  ///< of the film
  /// The number of groups follows from the samples or the speed; a resumed film may have this number or more. 0:
  /// exactly `groups`.
  int min_groups = 0;
  bool sample_variance = false;  ///< the film keeps the variance of samples
  PixelEstimate estimate;        ///< PassSettings::estimate
  /// A light pass (passes/light_pass.h): the film's samples are bundles of light paths, and the number in its
  /// random numbers is kLightPass + number.
  bool light = false;
  std::string
      settings;  ///< of the pass, appended to the integrator's in the film's attribute: everything that changes samples
  std::string estimator;  ///< attribute of the film if the pass itself makes the image; may be empty

  /// "crn", or "crn-2" if its number is not 0.
  std::string id() const { return number == 0 ? name : name + "-" + std::to_string(number); }
};

/// A pass during a render.
struct Pass {
  PassPlan plan;
  std::shared_ptr<const Integrator> integrator;
  PassSettings settings;  ///< spp: samples per pixel to reach
  Film film;
  std::string path;  ///< the film's file; empty if none
  /// The file belongs to this render alone and is removed once the image is written; otherwise it is kept.
  bool temporary = false;
  uint32_t count = 0;  ///< minimum over the pixels to be sampled
  /// For a light pass: the number of samples that matches the camera's; it may exceed what a film can hold if only a
  /// time limit ends the render.
  double wanted = 0;
  bool misses_error = false;     ///< the plan needs more samples for its target error than it may take
  double processor_seconds = 0;  ///< of its samples, accumulated like `result`
  PassResult result;             ///< accumulated over all calls, earlier ones included if a folder keeps the passes
};

/// State available to phases.
struct PlanState {
  const LoadedScene& scene;
  const RenderRequest& request;
  const std::atomic<bool>* stop;  ///< may be null; prepare() returns soon after it becomes true
  /// Traces the passes that begin from now on. A phase may replace it, e.g. with a trained one, whose description()
  /// then distinguishes the films.
  std::shared_ptr<const Integrator> integrator;
  uint32_t budget = 0;  ///< current target of samples per pixel of all passes together; grows towards a target error
  uint32_t group_budget = 0;  ///< the budget that determines the number of groups; fixed
  /// With a time limit: the time left for everything that follows when a phase's targets are set.
  std::optional<double> seconds_left;
  std::vector<Pass> passes;  ///< of this phase and all earlier ones, in the plan's order
  Features features;         ///< of the whole window, for the targets of the last phase, if Method::reads_features

  /// The pass with this name and number. Throws Error(kInternal) if none has begun.
  const Pass& pass(const std::string& name, uint32_t number = 0) const;
};

struct Phase {
  /// Fraction of the time limit that the phase may use; the fractions of a plan add up to 1.
  double share = 1;
  /// Optional work before the phase's films are created, such as training. Called once.
  std::function<void(PlanState&)> prepare;
  /// The passes, at least one. Called once, after prepare().
  std::function<std::vector<PassPlan>(const PlanState&)> passes;
  /// Sets how many samples each pass of the phase is to have for state.budget: settings.spp, a number or a map. Called
  /// before the phase is rendered, and again each time the budget grows.
  std::function<void(const PlanState&, std::span<Pass>)> set_targets;
};

/// What a method may read in addition to the films, for its rows.
struct ExtraInputs {
  Features features;            ///< if Method::reads_features
  std::vector<Layer> layers;    ///< if Method::splits_layers(); empty if none were requested
  const Film* light = nullptr;  ///< to be added to the samples, group by group (denoises_light() of light_plan.h)
};

/// If the integrator traces light, render() adds a pass "light" to those of the last phase; it advances with them, and
/// its film is added to the image (light_plan.h), or to the samples that are denoised. Phases only see the passes of
/// camera samples.
struct Plan {
  std::shared_ptr<const Method> method;  ///< what the plan renders for
  std::vector<Phase> phases;
  bool adds_films = false;        ///< the method gets the sum of both passes' films (denoised_passes.h)
  bool takes_unfinished = false;  ///< the method works even if some pixels have no samples yet
  bool takes_training = false;    ///< the integrator's training samples are part of the image
  bool has_crn_pass = false;      ///< some pass uses common random numbers
  bool traces_light = false;      ///< set by render(): there is a light pass
  /// With a time limit, the speed is measured before the passes begin, so that there are no more groups than samples.
  bool groups_follow_speed = false;

  /// The film of the only pass holds the image, and is what the output's file is made of: one can add samples to it.
  bool makes_film() const { return phases.size() == 1 && method->film_holds_image(); }
};

/// Rows first_row … first_row + n_rows - 1 of the image, from the current films of the camera's passes. Its cost
/// depends on the size, not on sample counts.
MethodImage image_of(const Plan& plan, std::span<const Pass> passes, int first_row, int n_rows,
                     const ExtraInputs& beside);

/// The passes without the light pass, which is the last if there is one.
std::span<const Pass> camera_passes(std::span<const Pass> passes);
/// The light pass, or null.
const Pass* light_pass(std::span<const Pass> passes);

}  // namespace covary
