// SPDX-License-Identifier: Apache-2.0
// Chooses the best of several integrators for a render. Each takes a few samples at pixels spread over the window;
// those that learn are first trained at the same pixels. The best has the least
//
//     variance of a sample, relative to the brightness as in relMSE, x rays per sample,
//
// which is the error at equal work, as [Grittmann2022] choose techniques of one bidirectional integrator. Counting rays
// instead of seconds makes the choice independent of the clock. Few samples give only a rough estimate, so another
// integrator must beat the simplest one clearly, and the largest values, from single bright samples, are clamped.
// Trials have their own random numbers and are not part of the image; they take about a twentieth of the samples.
#pragma once

#include "plans/render.h"

namespace covary {

struct IntegratorChosen {
  std::shared_ptr<const Integrator> integrator;  ///< one of Integrator::choices()
  std::vector<IntegratorTrial> trials;           ///< of each of them
};

/// For a scene whose integrator has choices. The result does not depend on the number of threads; if `stop` (may be
/// null) is set during the trials, it may be any of them.
IntegratorChosen choose_integrator(const LoadedScene& scene, const RenderRequest& request,
                                   const std::atomic<bool>* stop);

/// A request with a concrete integrator.
struct RequestOfChoice {
  RenderRequest request;
  std::vector<IntegratorTrial> trials;  ///< empty if there was nothing to choose
  double seconds = 0;                   ///< duration of the trials
};

/// If the scene's integrator has choices: the request with the chosen one. Its training is subtracted from `spp`
/// (take_training()), text_of() is added to the attributes, and the duration of the trials is subtracted from
/// `seconds`. Otherwise the request is unchanged.
RequestOfChoice request_of_choice(const LoadedScene& scene, const RenderRequest& request,
                                  const std::atomic<bool>* stop);

/// "guided-path: path 1, controlled-path 0.81, guided-path 0.42, bdpt not tried": variance x rays over those of the
/// first; for film_key::kTrial.
std::string text_of(const std::string& chosen, const std::vector<IntegratorTrial>& trials);

}  // namespace covary
