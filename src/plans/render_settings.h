// SPDX-License-Identifier: Apache-2.0
// What a render is asked for by options, declared once (settings/settings.h): those of the command line, and the
// arguments in Python. Options of integrators and estimators are declared by these.
#pragma once

#include <string>
#include <vector>

#include "combine/registry.h"
#include "denoising/mixed_denoising.h"
#include "plans/estimator_plans.h"
#include "plans/render.h"

namespace covary {

struct RenderSettings {
  RenderSettings() { request.checkpoint_seconds = 300; }

  std::string integrator;     ///< in place of the scene's; empty: that
  int width = 0, height = 0;  ///< in place of the scene's; 0: that
  RenderRequest request;      ///< as far as options say it
  PassChoice passes;
  std::string estimator = kNoEstimator;
  DenoisingChoice denoising;
};
/// The default is the mean of independent samples with `denoise` auto. Who names an estimator or a kind of sampling
/// gets exactly that, and no denoising that is not asked for.
void declare(Settings& settings, RenderSettings& render);

/// The estimator with these options of its own, denoised as the settings say. Throws Error(kUsage).
Estimator estimator_of(const RenderSettings& settings, const OptionValues& of_estimator);

/// The plan of that estimator, as the settings choose its passes. Throws Error(kUsage).
Plan render_plan(const RenderSettings& settings, const OptionValues& of_estimator);

/// The request, with what the scene's integrator takes of the settings. Throws Error(kUsage) for an option that nothing
/// takes.
RenderRequest request_of(const RenderSettings& settings, const LoadedScene& scene);

/// Takes the samples of the integrator's training, where it has one, off those of the passes, where their number is
/// known. Throws Error(kUsage) where none are left.
void take_training(const LoadedScene& scene, RenderRequest& request);

/// The words behind `covary render SCENE` that repeat one sample of a pass. `given`: options of rendering and of the
/// integrator.
std::vector<std::string> replay_words(OptionValues given, const Pass& pass, const BadSample& sample);

/// What options say of the samples that passes take, as words: equal words, equal passes, whatever is made of them.
std::vector<std::string> pass_words(OptionValues given, const OptionValues& of_integrator, OptionValues of_estimator);

}  // namespace covary
