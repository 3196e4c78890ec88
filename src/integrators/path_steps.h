// SPDX-License-Identifier: Apache-2.0
// Steps of camera paths that advance together, shared by the integrators that trace them. A `Batch` has those arrays of
// PathBatch that a step uses.
#pragma once

#include <cmath>
#include <optional>
#include <span>

#include "core/in_place.h"
#include "integrators/path_batch.h"
#include "integrators/path_lengths.h"
#include "integrators/primary_sample.h"
#include "sampling/environment_queue.h"
#include "sampling/roulette.h"

namespace covary {

/// Begins one path per sample, with its camera ray.
template <typename Batch>
void start_paths(std::span<const CameraSample> samples, Batch& batch) {
  batch.start(samples.size());
  for (uint32_t i = 0; i < samples.size(); ++i) batch.rays[i] = samples[i].ray, batch.paths[i].sample = i;
}

/// Continues the camera ray through area lights until something else is hit.
template <typename Path>
void skip_area_lights(const Scene& scene, Path& path, Ray& ray, SurfaceHit& hit, PathContext& context) {
  while (path.found && hit.emitter) {
    ray.o = offset_origin(hit, ray.d);
    ray.t_max -= hit.t;
    ++context.n_rays;
    path.found = scene.intersect(ray, hit);
  }
}

/// Marks a hit whose shading is deferred.
inline void mark_deferred(SurfaceHit& hit) { hit.bsdf = nullptr, hit.bsdf_flags = 0, hit.emitter = nullptr; }

/// Nearest hits of all rays; `depth`: edges before them. Hits for which `deferred` is true are left unresolved and
/// have no BSDF.
template <typename Batch, typename Deferred>
void find_surfaces(const Scene& scene, int depth, bool hide_emitters, Batch& batch, PathContext& context,
                   const Deferred& deferred) {
  const size_t n = batch.paths.size();
  // Camera rays are coherent, but traced as such their hits would depend on the others of the batch.
  scene.nearest(batch.rays, batch.ray_hits, false);
  context.n_rays += n;
  for (size_t i = 0; i < n; ++i) {
    batch.paths[i].found = batch.ray_hits[i].found();
    if (!batch.paths[i].found) continue;
    if (deferred(i)) {
      mark_deferred(batch.hits[i]);
      continue;
    }
    scene.resolve(batch.rays[i], batch.ray_hits[i], batch.hits[i]);
    if (const Texture* texture = batch.hits[i].shape->main_texture()) texture->prefetch(batch.hits[i].uv);
  }
  if (hide_emitters && depth == 0)
    for (size_t i = 0; i < n; ++i) skip_area_lights(scene, batch.paths[i], batch.rays[i], batch.hits[i], context);
}

template <typename Batch>
void find_surfaces(const Scene& scene, int depth, bool hide_emitters, Batch& batch, PathContext& context) {
  find_surfaces(scene, depth, hide_emitters, batch, context, [](size_t) { return false; });
}

/// Removes the paths for which `keep` is false; it is called once per path, in order.
template <typename Batch, typename Keep>
void keep_paths(Batch& batch, const Keep& keep) {
  size_t n_kept = 0;
  for (size_t i = 0; i < batch.paths.size(); ++i) {
    if (!keep(batch.paths[i])) continue;
    if (n_kept != i) {
      batch.paths[n_kept] = batch.paths[i], batch.rays[n_kept] = batch.rays[i];
      batch.ray_hits[n_kept] = batch.ray_hits[i];
      if (batch.hits[i].bsdf)
        batch.hits[n_kept] = batch.hits[i];
      else
        mark_deferred(batch.hits[n_kept]);
    }
    ++n_kept;
  }
  batch.resize(n_kept);
}

/// The vertex at which a path reads the random numbers of the surface it has hit. Mirrors and glass have their own
/// addresses: behind one, a path reads the same numbers as its neighbour that did not hit one.
inline uint32_t next_vertex(PathState& path, const SurfaceHit& hit, int depth) {
  return hit.bsdf_flags & kSmooth ? kFirstSurfaceVertex + path.n_smooth++
                                  : kDeltaVertices + static_cast<uint32_t>(depth);
}

/// Updates the path's state for a direction sample.
inline void scatter_path(PathState& path, const BsdfSample& next) {
  path.throughput *= next.weight;
  path.eta *= next.eta;
  if (!(next.flags & kNullTransmission)) path.only_null = false;
}

/// Continues a path from a surface in the sample's world direction `wi`.
inline void continue_path(PathState& path, Ray& ray, const SurfaceHit& hit, const BsdfSample& next, const Vec3& wi) {
  path.previous_p = hit.p;
  path.previous_pdf = next.pdf;
  path.previous_delta = next.is_delta();
  make_in_place(ray, [&] { return Ray{offset_origin(hit, wi), wi, kInfinity}; });
}

/// Calls visit(connection, whether it is occluded) for each connection of the batch, and removes them all.
template <typename Batch, typename Visit>
void visit_connections(const Scene& scene, Batch& batch, PathContext& context, const Visit& visit) {
  const size_t n = batch.n_connections;
  scene.occluded(std::span(batch.shadow_rays).first(n), batch.blocked);
  context.n_rays += n;
  for (size_t i = 0; i < n; ++i) visit(batch.connections[i], batch.blocked[i] != 0);
  batch.n_connections = 0;
}

/// Russian roulette by `parts` (roulette.h) with the random number of `vertex`, for a path of the given `throughput`:
/// the factor for survivors, or 0 if the path ends.
template <typename Parts>
float play_roulette(const Parts& parts, const PathState& path, const Spectrum& throughput, uint32_t vertex,
                    CameraSample& sample) {
  const float survival = parts.survival_probability(throughput, path.eta, sample.random.sampling());
  if (sample.random.get_1d(vertex, Event::kRoulette) < survival) return parts.survivor_weight(survival);
  if (std::isnan(survival)) sample.radiance = path.throughput;  // a bad sample instead of a black one
  return 0;
}

/// Adds the unoccluded light samples.
inline void add_connections(const Scene& scene, std::span<CameraSample> samples, PathBatch& batch,
                            PathContext& context) {
  visit_connections(scene, batch, context, [&](const LightConnection& connection, bool hidden) {
    if (!hidden) samples[connection.sample].radiance += connection.radiance;
  });
}

/// Removes the paths that are not in Batch::alive, and their rays.
template <typename Batch>
void keep_alive(Batch& batch) {
  for (size_t n = 0; n < batch.alive.size(); ++n)
    if (const uint32_t i = batch.alive[n]; i != n) batch.paths[n] = batch.paths[i], batch.rays[n] = batch.rays[i];
  batch.resize(batch.alive.size());
}

/// The emitter that the ray of a path may have hit, on a surface, the background or the `environment`, or null.
inline const Emitter* emitter_met(const PathState& path, const SurfaceHit& hit, const Scene& scene,
                                  const Emitter* environment, bool hide_emitters) {
  if (path.found) return hit.emitter;
  if (!path.only_null) return environment;
  return scene.background() ? scene.background() : hide_emitters ? nullptr : environment;
}
/// Its radiance along the ray; the density is that of the environment.
inline EnvironmentLight emitted_light(const Emitter& emitter, const PathState& path, const Ray& ray,
                                      const SurfaceHit& hit) {
  return path.found ? EnvironmentLight{emitter.surface_radiance(hit, -ray.d)} : emitter.environment(ray.d);
}

/// A surface that a path has reached, ready for sampling.
struct PathVertex {
  const SurfaceHit& hit;
  const BsdfClosure& bsdf;
  Vec3 wo;               ///< direction the path came from, in the surface's frame
  uint32_t address;      ///< of its random numbers
  CameraSample& sample;  ///< of the path
};

/// The loop of all integrators that follow paths from the camera. The paths of a started batch advance together, one
/// edge at a time, in short loops with independent iterations: while one waits for memory or a division, the processor
/// works on the next. The `steps` of an integrator at each edge, `depth` edges from the camera:
/// - arrive(depth, i): the ray of path i has hit something, or left the scene;
/// - goes_on(depth, path): whether a path that has hit a surface continues;
/// - sample_lights(depth): for the vertices of all remaining paths;
/// - scatter(depth, i, vertex): connects the vertex and samples the next ray; false if the path ends;
/// - connect(depth): traces the connections.
template <typename Batch, typename Steps>
void follow_paths(const Scene& scene, const PathLengthSettings& lengths, std::span<CameraSample> samples, Batch& batch,
                  PathContext& context, Steps&& steps) {
  for (int depth = 0; !batch.paths.empty(); ++depth) {
    find_surfaces(scene, depth, lengths.hide_emitters, batch, context, [&](size_t i) {
      if constexpr (requires { steps.finish_deferred(depth); })
        return steps.defers(batch.rays[i], batch.ray_hits[i]);
      else
        return false;
    });
    for (size_t i = 0; i < batch.paths.size(); ++i) steps.arrive(depth, i);
    if (depth + 1 >= lengths.max_depth || context.stopped()) break;
    keep_paths(batch, [&](auto& path) { return path.found && steps.goes_on(depth, path); });
    steps.sample_lights(depth);
    batch.goes_on.assign(batch.paths.size(), false);
    for (uint32_t i = 0; i < batch.paths.size(); ++i) {
      const SurfaceHit& hit = batch.hits[i];
      if constexpr (requires { steps.finish_deferred(depth); })
        if (!hit.bsdf) {
          steps.scatter_deferred(depth, i);
          continue;
        }
      const Vec3 wo = hit.frame.to_local(-batch.rays[i].d);
      const uint32_t address = next_vertex(batch.paths[i], hit, depth);
      context.arena.reset();
      const BsdfClosure* bsdf = hit.bsdf->bind(hit, wo.z > 0, TransportMode::kRadiance, context.arena);
      batch.goes_on[i] = steps.scatter(depth, i, PathVertex{hit, *bsdf, wo, address, samples[batch.paths[i].sample]});
    }
    if constexpr (requires { steps.finish_deferred(depth); }) steps.finish_deferred(depth);
    batch.alive.clear();
    for (uint32_t i = 0; i < batch.paths.size(); ++i)
      if (batch.goes_on[i]) batch.alive.push_back(i);
    keep_alive(batch);
    steps.connect(depth);
  }
}

/// One light sample for each vertex whose surface can use it.
template <typename Lights>
void sample_lights(const Scene& scene, const Lights& lights, std::span<const CameraSample> samples, PathBatch& batch) {
  const auto set = [&batch](uint32_t i, const EmitterSample& sample) { batch.lights[i] = sample; };
  std::optional<EnvironmentQueue> environment;
  if (scene.environment()) environment.emplace(*scene.environment());
  for (uint32_t i = 0; i < batch.paths.size(); ++i) {
    batch.choices[i] = nullptr;
    batch.lights[i].pdf_solid_angle = 0;
    if (!(batch.hits[i].bsdf_flags & kSmooth)) continue;
    const PathRandom& random = samples[batch.paths[i].sample].random;
    const uint32_t vertex = kFirstSurfaceVertex + batch.paths[i].n_smooth;
    const Emitter& emitter = lights.select(random.get_1d(vertex, Event::kLightChoice));
    const Vec2 u = random.get_2d(vertex, Event::kLightPosition);
    batch.choices[i] = &emitter;
    if (&emitter == scene.environment())
      environment->add(i, u, set);
    else
      make_in_place(batch.lights[i], [&] {
        return emitter.sample_towards(batch.hits[i].p, u, random.get_1d(vertex, Event::kLightPrimitive));
      });
  }
  if (environment) environment->finish(set);
}

}  // namespace covary
