// SPDX-License-Identifier: Apache-2.0
// Chooses the best of several integrators for a render (ours). Each takes a few samples at pixels all over the window,
// those that learn after a training at the same pixels; the best has the least
//
//     variance of a sample, relative to the brightness as in relMSE, x rays that a sample takes,
//
// which is the error for equal work. Counting rays instead of seconds makes the choice independent of the clock. Few
// samples estimate this only roughly, so another integrator must beat the simplest clearly, and the largest values,
// from single bright samples, are cut off. Trials have their own random numbers and are not part of the image; they
// take about a twentieth of the samples.
#pragma once

#include "plans/render.h"

namespace covary {

struct IntegratorChosen {
  std::shared_ptr<const Integrator> integrator;  ///< one of Integrator::choices()
  std::vector<IntegratorTrial> trials;           ///< of each of them
};

/// For a scene whose integrator has choices. The same for any number of threads; if `stop` (may be null) is set
/// meanwhile, any of them.
IntegratorChosen choose_integrator(const LoadedScene& scene, const RenderRequest& request,
                                   const std::atomic<bool>* stop);

/// A request with an integrator that traces itself.
struct RequestOfChoice {
  RenderRequest request;
  std::vector<IntegratorTrial> trials;  ///< empty if there was nothing to choose
  double seconds = 0;                   ///< that they took
};

/// The request with a chosen integrator if the scene's has choices: its training is subtracted from `spp`
/// (take_training()), the text below is among its attributes, and the time of the trials is subtracted from `seconds`.
/// Otherwise the request is unchanged.
RequestOfChoice request_of_choice(const LoadedScene& scene, const RenderRequest& request,
                                  const std::atomic<bool>* stop);

/// "guided-path: path 1, controlled-path 0.81, guided-path 0.42, bdpt not tried": variance x rays over those of the
/// first; for film_key::kTrial.
std::string text_of(const std::string& chosen, const std::vector<IntegratorTrial>& trials);

}  // namespace covary
