// SPDX-License-Identifier: Apache-2.0
// Memory of a render, estimated before it is allocated.
#pragma once

#include <span>
#include <string>

#include "core/memory_limit.h"
#include "plans/plan.h"

namespace covary {

struct RenderMemory {
  double films = 0;     ///< bytes: samples of all passes, auxiliary images
  double estimate = 0;  ///< bytes: working memory of the estimator, including the image
  double training = 0;  ///< bytes: upper bound for the integrator's training
  double total() const { return films + estimate + training; }
};

/// For a render of width x height pixels with these passes, without the scene.
RenderMemory render_memory(const Plan& plan, std::span<const PassPlan> passes, int width, int height, bool aovs);

/// Bytes that the training of a scene's integrator may take; 0 if it does not learn.
double training_memory(const LoadedScene& scene, const RenderRequest& request);

/// The same for the passes of the plan's first phase, which depend only on the scene and the request.
RenderMemory render_memory(const LoadedScene& scene, const Plan& plan, const RenderRequest& request);

/// Throws Error(kUsage) if the render needs more than memory_limit().
void check_memory(const RenderMemory& memory, int width, int height);

}  // namespace covary
