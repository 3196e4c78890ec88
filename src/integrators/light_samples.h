// SPDX-License-Identifier: Apache-2.0
// Shared by tracers that sample one light of a LightSet at each vertex, and the environment separately.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "core/in_place.h"
#include "integrators/primary_sample.h"
#include "passes/integrator.h"
#include "sampling/environment_queue.h"
#include "sampling/light_set.h"

namespace covary {

/// Offset of the addresses of environment samples' numbers, distinct from all others.
inline constexpr uint32_t kEnvironmentVertices = 1u << 21;

/// The light that a vertex samples, and the random numbers for it.
struct LightSetChoice {
  bool open = false;   ///< the surface can use light samples
  uint32_t light = 0;  ///< number of the light
  Vec2 u, u_environment;
  float u_primitive = 0;
};

/// Chooses what the vertices of `batch` sample; nothing without `connect`. All choices are made and prefetched before
/// the first sample is taken, so that memory accesses overlap. `environment`: as sampled, or null.
template <typename Batch>
void choose_lights(const LightSet& lights, const Emitter* environment, std::span<const CameraSample> samples,
                   bool connect, Batch& batch) {
  for (size_t i = 0; i < batch.paths.size(); ++i) {
    LightSetChoice& choice = batch.choices[i];
    choice.open = connect && (batch.hits[i].bsdf_flags & kSmooth);
    if (!choice.open) continue;
    const PathRandom& random = samples[batch.paths[i].sample].random;
    const uint32_t vertex = kFirstSurfaceVertex + batch.paths[i].n_smooth;
    if (!lights.empty()) {
      choice.light = lights.select(random.get_1d(vertex, Event::kLightChoice));
      lights.prefetch(choice.light);
      choice.u = random.get_2d(vertex, Event::kLightPosition);
      choice.u_primitive = random.get_1d(vertex, Event::kLightPrimitive);
    }
    if (environment) choice.u_environment = random.get_2d(kEnvironmentVertices + vertex, Event::kLightPosition);
  }
}

/// The light and environment samples of all vertices; densities are 0 where there are none.
template <typename Batch>
void sample_lights(const LightSet& lights, const Emitter* environment, Batch& batch) {
  const auto set = [&batch](uint32_t i, const EmitterSample& sample) { batch.environments[i] = sample; };
  std::optional<EnvironmentQueue> queue;
  if (environment) queue.emplace(*environment);
  for (uint32_t i = 0; i < batch.paths.size(); ++i) {
    const LightSetChoice& choice = batch.choices[i];
    batch.lights[i].pdf_solid_angle = batch.environments[i].pdf_solid_angle = 0;
    if (!choice.open) continue;
    const Vec3& p = batch.hits[i].p;
    if (!lights.empty())
      make_in_place(batch.lights[i], [&] { return lights.sample(choice.light, p, choice.u, choice.u_primitive); });
    if (queue) queue->add(i, choice.u_environment, set);
  }
  if (queue) queue->finish(set);
}

}  // namespace covary
