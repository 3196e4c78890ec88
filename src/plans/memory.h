// SPDX-License-Identifier: Apache-2.0
// How much memory a render takes, known before it is taken.
#pragma once

#include <span>
#include <string>

#include "core/memory_limit.h"
#include "plans/plan.h"

namespace covary {

struct RenderMemory {
  double films = 0;     ///< bytes: samples of all passes, auxiliary images
  double estimate = 0;  ///< bytes: what the estimator adds, the image included
  double training = 0;  ///< bytes: what the integrator may take to learn, at most
  double total() const { return films + estimate + training; }
};

/// Of a render of width x height pixels with these passes; the scene is not counted.
RenderMemory render_memory(const Plan& plan, std::span<const PassPlan> passes, int width, int height, bool aovs);

/// Bytes that a scene's integrator may take to learn; 0 where it does not.
double training_memory(const LoadedScene& scene, const RenderRequest& request);

/// The same for the passes of the plan's first phase, which the scene and the request alone determine.
RenderMemory render_memory(const LoadedScene& scene, const Plan& plan, const RenderRequest& request);

/// Throws Error(kUsage) where the render needs more than memory_limit().
void check_memory(const RenderMemory& memory, int width, int height);

}  // namespace covary
