// SPDX-License-Identifier: Apache-2.0
// Replays a single sample or light path of a render.
#include <fmt/format.h>

#include "core/error.h"
#include "passes/light_pass.h"
#include "plans/budget.h"
#include "plans/integrator_trial.h"
#include "plans/light_plan.h"
#include "plans/render.h"
#include "plans/training_stage.h"

namespace covary {
namespace {

PassSettings settings_of(const LoadedScene& scene, const RenderRequest& request, const SampleAddress& address) {
  if (address.x < 0 || address.y < 0 || address.x >= scene.width || address.y >= scene.height)
    throw Error(ErrorCode::kUsage, fmt::format("pixel ({}, {}) is outside the {} x {} frame", address.x, address.y,
                                               scene.width, scene.height));
  PassSettings settings;
  settings.sampling = address.sampling;
  settings.sampler = sampler_of(scene, request);
  if (settings.sampler == Sampler::kSobol && !address.groups)
    throw Error(ErrorCode::kUsage,
                "a sample of `sampler` sobol is one of a group; `groups` says how many groups the "
                "film has, 'covary info FILM' shows it");
  settings.groups = address.groups.value_or(1);
  settings.seed = request.seed;
  settings.pass = address.pass;
  settings.filter = request.filter.value_or(scene.filter);
  return settings;
}

}  // namespace

std::vector<ReplayedSample> replay(const LoadedScene& scene, const Plan& plan, const RenderRequest& asked,
                                   std::span<const SampleAddress> addresses) {
  const RenderRequest request = request_of_choice(scene, asked, nullptr).request;
  std::vector<PassSettings> passes;
  for (const SampleAddress& address : addresses) passes.push_back(settings_of(scene, request, address));
  const auto integrator = prepared_integrator(scene, plan, request);
  const FilterSettings filter = request.filter.value_or(scene.filter);
  RenderSeconds seconds;
  // As in the render: sums for two halves of the image round differently from sums for one.
  TrainingImage image;
  TrainingSettings training{window_of(scene, request), filter, nullptr, nullptr, {}};
  if (plan.takes_training) training.image = &image;
  train(scene, request, *integrator, training, seconds);
  std::vector<ReplayedSample> samples;
  for (size_t i = 0; i < addresses.size(); ++i) {
    const SampleAddress& at = addresses[i];
    samples.push_back(replay_sample(*scene.scene, *integrator, passes[i], at.x, at.y, at.sample));
  }
  return samples;
}

ReplayedSample replay(const LoadedScene& scene, const Plan& plan, const RenderRequest& request,
                      const SampleAddress& address) {
  return replay(scene, plan, request, std::span(&address, 1))[0];
}

ReplayedLightPath replay_light(const LoadedScene& scene, const Plan& plan, const RenderRequest& asked, uint64_t path) {
  const RenderRequest request = request_of_choice(scene, asked, nullptr).request;
  const auto integrator = prepared_integrator(scene, plan, request);
  const LightTracingIntegrator* tracer = light_tracer(*integrator);
  if (!tracer)
    throw Error(ErrorCode::kUsage,
                fmt::format("there are no light paths: '{}' traces none here", integrator->description()));
  PassSettings settings;
  settings.seed = request.seed;
  settings.pass = kLightPass;
  settings.filter = request.filter.value_or(scene.filter);
  return replay_light_path(*scene.scene, *tracer, settings, window_of(scene, request), path);
}

}  // namespace covary
