// SPDX-License-Identifier: Apache-2.0
// Steps of camera paths that advance together, common to the integrators that trace them. A `Batch` has the arrays of
// PathBatch that a step names.
#pragma once

#include <cmath>
#include <span>

#include "core/in_place.h"
#include "integrators/path_batch.h"
#include "integrators/primary_sample.h"
#include "integrators/roulette.h"

namespace covary {

/// Follows the camera ray past area lights until something else is hit.
template <typename Path>
void skip_area_lights(const Scene& scene, Path& path, Ray& ray, SurfaceHit& hit, PathContext& context) {
  while (path.found && hit.emitter) {
    ray.o = offset_origin(hit, ray.d);
    ray.t_max -= hit.t;
    ++context.n_rays;
    path.found = scene.intersect(ray, hit);
  }
}

/// Nearest hits of all rays; `depth`: edges before them.
template <typename Batch>
void find_surfaces(const Scene& scene, int depth, bool hide_emitters, Batch& batch, PathContext& context) {
  const size_t n = batch.paths.size();
  scene.nearest(batch.rays, batch.ray_hits, depth == 0);
  context.n_rays += n;
  for (size_t i = 0; i < n; ++i) {
    batch.paths[i].found = batch.ray_hits[i].found();
    if (!batch.paths[i].found) continue;
    scene.resolve(batch.rays[i], batch.ray_hits[i], batch.hits[i]);
    if (const Texture* texture = batch.hits[i].shape->main_texture()) texture->prefetch(batch.hits[i].uv);
  }
  if (hide_emitters && depth == 0)
    for (size_t i = 0; i < n; ++i) skip_area_lights(scene, batch.paths[i], batch.rays[i], batch.hits[i], context);
}

/// Removes the paths of which `keep` is false; it is asked once for each, in their order.
template <typename Batch, typename Keep>
void keep_paths(Batch& batch, const Keep& keep) {
  size_t n_kept = 0;
  for (size_t i = 0; i < batch.paths.size(); ++i) {
    if (!keep(batch.paths[i])) continue;
    if (n_kept != i)
      batch.paths[n_kept] = batch.paths[i], batch.rays[n_kept] = batch.rays[i], batch.hits[n_kept] = batch.hits[i];
    ++n_kept;
  }
  batch.resize(n_kept);
}

/// Plays Russian roulette with a path that carries `throughput`, and returns what is to be multiplied to what it
/// carries; 0: it ends.
template <typename Path>
float play_roulette(const Path& path, const Spectrum& throughput, CameraSample& sample) {
  const float survival = roulette::survival_probability(throughput, path.eta, sample.random.sampling());
  if (sample.random.get_1d(path.last_vertex, Event::kRoulette) < survival) return roulette::survivor_weight(survival);
  if (std::isnan(survival)) sample.radiance = path.throughput;  // a bad sample, not a black one
  return 0;
}

/// Removes the paths that left the scene.
inline void end_paths_without_surface(PathBatch& batch) {
  keep_paths(batch, [](const PathBatch::Path& path) { return path.found; });
}

/// Removes the paths that are not among Batch::alive, with their next rays.
template <typename Batch>
void keep_alive(Batch& batch) {
  for (size_t n = 0; n < batch.alive.size(); ++n)
    if (const uint32_t i = batch.alive[n]; i != n) batch.paths[n] = batch.paths[i], batch.rays[n] = batch.rays[i];
  batch.resize(batch.alive.size());
}

/// One light sample for each vertex whose surface can use it. All choices come first, so that memory answers to one
/// while the others are made.
template <typename Lights>
void sample_lights(const Scene& scene, const Lights& lights, std::span<const CameraSample> samples, PathBatch& batch) {
  for (size_t i = 0; i < batch.paths.size(); ++i) {
    batch.choices[i].emitter = nullptr;
    if (!(batch.hits[i].bsdf_flags & kSmooth)) continue;
    const PathRandom& random = samples[batch.paths[i].sample].random;
    const uint32_t vertex = kFirstSurfaceVertex + batch.paths[i].n_smooth;
    const Emitter& emitter = lights.select(random.get_1d(vertex, Event::kLightChoice));
    const Vec2 u = random.get_2d(vertex, Event::kLightPosition);
    if (scene.environment()) emitter.prefetch(u, PrefetchStep::kTable);
    batch.choices[i].emitter = &emitter;
    batch.choices[i].u = u;
    batch.choices[i].u_primitive = random.get_1d(vertex, Event::kLightPrimitive);
  }
  if (scene.environment())  // the only lights with large tables
    for (size_t i = 0; i < batch.paths.size(); ++i)
      if (batch.choices[i].emitter) batch.choices[i].emitter->prefetch(batch.choices[i].u, PrefetchStep::kValues);
  for (size_t i = 0; i < batch.paths.size(); ++i) {
    const PathBatch::LightChoice& choice = batch.choices[i];
    if (!choice.emitter)
      batch.lights[i].pdf_solid_angle = 0;
    else
      make_in_place(batch.lights[i],
                    [&] { return choice.emitter->sample_towards(batch.hits[i].p, choice.u, choice.u_primitive); });
  }
}

}  // namespace covary
