// SPDX-License-Identifier: Apache-2.0
// Which of several integrators a render is best made by (ours). Each takes a few samples at pixels all over the window,
// those that learn after a training at the same pixels; the best is the one with the least
//
//     variance of a sample, relative to the brightness as in relMSE, x rays that a sample takes,
//
// which is the error for the same work. Rays are counted, not seconds, so that the choice does not depend on the clock.
// Few samples know this roughly, so that the simplest is left only for one that is clearly better, and the largest
// values, which single bright samples make, are cut off. Trials have random numbers of their own and are no part of the
// image; they take about a twentieth of the samples.
#pragma once

#include "plans/render.h"

namespace covary {

struct IntegratorChosen {
  std::shared_ptr<const Integrator> integrator;  ///< one of Integrator::choices()
  std::vector<IntegratorTrial> trials;           ///< of each of them
};

/// For a scene whose integrator has choices. The same for any number of threads; where `stop` (may be null) is set
/// meanwhile, any of them.
IntegratorChosen choose_integrator(const LoadedScene& scene, const RenderRequest& request,
                                   const std::atomic<bool>* stop);

/// A request whose integrator traces itself.
struct RequestOfChoice {
  RenderRequest request;
  std::vector<IntegratorTrial> trials;  ///< empty where there was nothing to choose
  double seconds = 0;                   ///< that they took
};

/// The request with a chosen integrator where that of the scene has choices, what its training takes off its `spp`
/// (take_training()), the text below among its attributes, and its `seconds` less those of the trials; otherwise as it
/// is.
RequestOfChoice request_of_choice(const LoadedScene& scene, const RenderRequest& request,
                                  const std::atomic<bool>* stop);

/// "guided-path: path 1, controlled-path 0.81, guided-path 0.42, bdpt not tried": variance x rays over those of the
/// first; for film_key::kTrial.
std::string text_of(const std::string& chosen, const std::vector<IntegratorTrial>& trials);

}  // namespace covary
