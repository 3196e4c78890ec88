// SPDX-License-Identifier: Apache-2.0
// The options of a render, declared once (settings/settings.h): those of the command line, and the arguments in Python.
// Integrators and estimators declare their own options.
#pragma once

#include <string>
#include <vector>

#include "combine/registry.h"
#include "denoising/mixed_denoising.h"
#include "plans/estimator_plans.h"
#include "plans/render.h"

namespace covary {

struct RenderSettings {
  RenderSettings() { request.checkpoint_seconds = 300, view.environment = "auto"; }

  std::string integrator;     ///< replaces the scene's; empty: the scene's
  int width = 0, height = 0;  ///< replaces the scene's; 0: the scene's
  SceneView view;
  RenderRequest request;  ///< as far as options determine it
  PassChoice passes;
  std::string estimator = kDefaultEstimator;
  DenoisingChoice denoising;
  std::string device = "cpu";  ///< where images are estimated, as gpu::Target::open() takes it
};
/// An estimator or kind of sampling that is named explicitly is used as it is, without denoising unless requested.
void declare(Settings& settings, RenderSettings& render);

/// The estimator with its options, denoised as the settings say. Throws Error(kUsage).
Method estimator_of(const RenderSettings& settings, const OptionValues& of_estimator);

/// Throws Error(kUsage) for options among `given` that the method does not have, whoever gives them.
void check_given(const OptionValues& given, const RenderSettings& settings, const Method& method);

/// The plan of that estimator, with the passes that the settings choose. Throws Error(kUsage).
Plan render_plan(const RenderSettings& settings, const OptionValues& of_estimator);

/// The request, with the settings that the scene's integrator takes. Throws Error(kUsage) for options that nothing
/// uses.
RenderRequest request_of(const RenderSettings& settings, const LoadedScene& scene);

/// What to use instead where options do little for so many samples per pixel: `denoise` balanced or bias around the
/// mean of few independent samples, a pair of passes with few samples. Empty if there is nothing to say, or the number
/// is not known.
std::string advice(const RenderSettings& settings, const Method& estimator, const LoadedScene& scene);

/// Subtracts the samples of the integrator's training, if any, from those of the passes, if their number is known.
/// Throws Error(kUsage) if none are left.
void take_training(const LoadedScene& scene, RenderRequest& request);

/// The arguments after `covary render SCENE` that replay one sample of a pass. `given`: options of rendering and of the
/// integrator. `seed_offset`: what the frame of a sequence adds to the command's seed.
std::vector<std::string> replay_words(OptionValues given, const Pass& pass, const BadSample& sample,
                                      uint64_t seed_offset = 0);

/// The options that determine the samples of passes, as words: equal words mean equal passes, whatever is computed from
/// them.
std::vector<std::string> pass_words(OptionValues given, const OptionValues& of_integrator, OptionValues of_estimator);

}  // namespace covary
