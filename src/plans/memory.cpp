// SPDX-License-Identifier: Apache-2.0
#include "plans/memory.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <limits>

#include "core/error.h"
#include "integrators/aov.h"
#include "passes/sample_parts.h"
#include "passes/training.h"
#include "plans/budget.h"
#include "plans/integrator_choice.h"
#include "plans/light_plan.h"
#include "plans/render.h"

namespace covary {
namespace {

constexpr double kImageBytes = 3 * sizeof(float);  // per pixel
constexpr double kImagesOfLayer = 12;              // per pixel, during denoising
constexpr double kSplatBytes = 16e6;               // of a round of light paths, approximately

}  // namespace

RenderMemory render_memory(const Plan& plan, std::span<const PassPlan> passes, int width, int height, bool aovs) {
  const double n_pixels = static_cast<double>(width) * height;
  RenderMemory memory;
  int min_groups = std::numeric_limits<int>::max();
  for (const PassPlan& pass : passes) {
    min_groups = std::min(min_groups, pass.groups);
    const double film = n_pixels * ((pass.groups + (pass.sample_variance ? 1 : 0)) * kImageBytes + sizeof(uint32_t));
    memory.films += film + (pass.light ? kSplatBytes : 0);
    if (pass.light && plan.method->one_pass()) memory.estimate += film;  // the sum of both films
  }
  if (aovs) memory.films += n_pixels * kAuxiliaryFeatures.size() * kImageBytes;
  // A copy for a viewer or the preview.
  memory.estimate += plan.method->memory.bytes(n_pixels, min_groups) + n_pixels * kImageBytes;
  return memory;
}

RenderMemory render_memory(const LoadedScene& scene, const Plan& plan, const RenderRequest& request) {
  PlanState state{scene, request, nullptr, nullptr, 0, 0, {}};
  state.budget = state.group_budget = samples_before_check(scene, plan, request);
  const CropWindow window = window_of(scene, request);
  std::vector<PassPlan> passes;
  for (const Phase& phase : plan.phases)
    for (const PassPlan& pass : phase.passes(state)) passes.push_back(pass);
  if (has_light_pass(scene, plan, request)) passes.push_back(light_pass_plan(plan, passes));
  const bool aovs = request.aovs || request.alpha || plan.method->reads_features;
  RenderMemory memory = render_memory(plan, passes, window.width, window.height, aovs);
  memory.training = training_memory(scene, request);
  if (request.splits_layers()) {
    // Films of all layers, which the denoiser copies, and for each an image per candidate.
    const size_t n = request.layers ? std::size(kLayerNames) : light_groups(*scene.scene).size() + 1;
    const double images = static_cast<double>(n) * (2.0 * passes.back().groups + kImagesOfLayer);
    memory.films += window.width * window.height * images * kImageBytes;
  }
  if (request.path_lengths) memory.films += window.width * window.height * kMaxEdges * kImageBytes;
  return memory;
}

double training_memory(const LoadedScene& scene, const RenderRequest& request) {
  if (!scene.integrator) return 0;
  const LearningIntegrator* learning = integrator_of(scene, request).learning();
  return learning ? static_cast<double>(learning->training_memory()) : 0;
}

void check_memory(const RenderMemory& memory, int width, int height) {
  if (memory.total() <= memory_limit()) return;
  throw Error(
      ErrorCode::kUsage,
      fmt::format("{} x {} pixels need {} of memory ({} for films, {} for the estimator{}); render fewer "
                  "pixels, a part of the frame, or with fewer groups; {}",
                  width, height, bytes_text(memory.total()), bytes_text(memory.films), bytes_text(memory.estimate),
                  memory.training > 0 ? ", " + bytes_text(memory.training) + " to learn" : "", memory_limit_text()));
}

}  // namespace covary
