// SPDX-License-Identifier: Apache-2.0
// Subpaths from the lights, for bidirectional path tracing: emission, then a random walk by BSDF sampling, for many
// paths together, one edge at a time.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "core/error.h"
#include "core/in_place.h"
#include "integrators/bdpt_weights.h"
#include "integrators/primary_sample.h"
#include "integrators/subpath_store.h"
#include "passes/integrator.h"
#include "sampling/light_selection.h"

namespace covary {

/// A connectible vertex of a light subpath: on a surface with more than delta lobes.
struct LightVertex {
  Vec3 p;
  Vec3 ng;                  ///< unit geometric normal
  float offset;             ///< SurfaceHit::offset
  Frame frame;              ///< shading frame
  Vec3 ng_local;            ///< ng in the frame
  Vec3 wo;                  ///< towards the previous vertex, in the frame
  const BsdfClosure* bsdf;  ///< bound for importance
  Spectrum throughput;      ///< of the subpath up to here, including emission densities
  SubpathSums sums;
  uint32_t n_vertices;  ///< of the subpath up to here, including the light and delta vertices
  uint32_t address;     ///< address of its random numbers
  bool on_light;        ///< the surface emits
};

/// Closures that live together until reset().
class ClosureStore {
 public:
  void reset() { n_used_ = 0; }
  const BsdfClosure* bind(const SurfaceHit& hit, bool wo_front, TransportMode mode) {
    if (n_used_ == 0 || arenas_[n_used_ - 1]->used() > Arena::kCapacity / 2) begin_arena();
    const bool fresh = arenas_[n_used_ - 1]->used() == 0;
    try {
      return hit.bsdf->bind(hit, wo_front, mode, *arenas_[n_used_ - 1]);
    } catch (const Error&) {
      if (fresh) throw;
    }
    begin_arena();  // the current arena is too full
    return hit.bsdf->bind(hit, wo_front, mode, *arenas_[n_used_ - 1]);
  }

 private:
  void begin_arena() {
    if (n_used_ == arenas_.size()) arenas_.push_back(std::make_unique<Arena>());
    arenas_[n_used_++]->reset();
  }

  std::vector<std::unique_ptr<Arena>> arenas_;
  size_t n_used_ = 0;
};

/// Light subpaths that are traced together, with the arrays needed.
class LightSubpaths {
 public:
  /// Traces a subpath for each of `randoms`, its random numbers, with at most `max_surfaces` vertices beside the light;
  /// roulette begins after `rr_depth` edges. `parts`: those of the integrator (bidirectional_tracer.h).
  template <typename Parts>
  void trace(const Parts& parts, const Scene& scene, const PowerLights& lights, const BidirectionalMis& mis,
             std::span<const PathRandom> randoms, int max_surfaces, int rr_depth, PathContext& context);

  /// The connectible vertices of a path.
  std::span<const LightVertex> path(size_t path) const { return vertices_.path(path); }

 private:
  struct Path {
    Spectrum throughput;
    float scale;  ///< roulette uses throughput * scale
    SubpathSums sums;
    Vec3 previous_p;
    uint32_t index;         ///< among those traced together
    uint32_t n_smooth = 0;  ///< vertices so far on surfaces with more than delta lobes
    bool ends = false;      ///< at its next vertex
  };
  /// How a path started.
  struct Start {
    const Emitter* emitter;
    Vec3 n;
    Vec2 uv;
    float emission_pmf;
    EmissionPdf emission;
  };

  template <typename Parts>
  void emit(const Parts& parts, const PowerLights& lights, std::span<const PathRandom> randoms);
  /// The sums of a path at the first surface it hits.
  static SubpathSums first_sums(const Scene& scene, const BidirectionalMis& mis, const Start& start, const Path& path,
                                const Ray& ray, const SurfaceHit& hit, double cosine);
  /// Processes one vertex: stores it and samples the next ray; false if the path ends.
  template <typename Parts>
  bool scatter(const Parts& parts, const BidirectionalMis& mis, const PathRandom& random, int depth, bool last,
               bool roulette, const SurfaceHit& hit, Path& path, Ray& ray);

  std::vector<Path> paths_;
  std::vector<Ray> rays_;
  std::vector<Start> starts_;  // by Path::index
  std::vector<RayHit> ray_hits_;
  SubpathStore<LightVertex> vertices_;
  ClosureStore closures_;
};

template <typename Parts>
void LightSubpaths::emit(const Parts& parts, const PowerLights& lights, std::span<const PathRandom> randoms) {
  paths_.clear(), rays_.clear();
  starts_.resize(randoms.size());
  for (uint32_t i = 0; i < randoms.size(); ++i) {
    const Emitter& emitter = lights.select(randoms[i].get_1d(0, Event::kLightChoice));
    const EmissionSample from = emitter.sample_emission(randoms[i].get_2d(0, Event::kLightPosition),
                                                        randoms[i].get_2d(0, Event::kLightDirection),
                                                        randoms[i].get_1d(0, Event::kLightPrimitive));
    const float pmf = parts.emission_pmf(lights, emitter), pdf = from.pdf_position * from.pdf_direction;
    if (!(pdf > 0) || is_black(from.radiance)) continue;
    const Vec3& d = from.ray.d;
    const Spectrum throughput = from.radiance * (std::abs(dot(from.n, d)) / (pmf * pdf));
    starts_[i] = {&emitter, from.n, from.uv, lights.pmf(emitter), {from.pdf_position, from.pdf_direction}};
    const Vec3& p = from.ray.o;
    paths_.push_back({throughput, 1 / max_component(throughput), {}, p, i});
    rays_.push_back({offset_origin(p, from.n, from.offset, d), d, kInfinity});
  }
}

inline SubpathSums LightSubpaths::first_sums(const Scene& scene, const BidirectionalMis& mis, const Start& start,
                                             const Path& path, const Ray& ray, const SurfaceHit& hit, double cosine) {
  const Emitter& emitter = *start.emitter;
  float pdf_direct = 1;
  if (emitter.is_environment())
    pdf_direct = emitter.environment(-ray.d).pdf_solid_angle;
  else if (!emitter.is_delta() || emitter.shape())
    pdf_direct = emitter.pdf_solid_angle(hit.p, point_on_light(path.previous_p, start.n, start.uv));
  const float nee_pmf = UniformLights(scene).pmf(emitter);
  return mis.first_surface(light_pdfs(emitter, nee_pmf, pdf_direct, start.emission_pmf, start.emission, start.n, ray.d,
                                      length_squared(hit.p - path.previous_p)),
                           cosine);
}

template <typename Parts>
void LightSubpaths::trace(const Parts& parts, const Scene& scene, const PowerLights& lights,
                          const BidirectionalMis& mis, std::span<const PathRandom> randoms, int max_surfaces,
                          int rr_depth, PathContext& context) {
  vertices_.start(randoms.size());
  closures_.reset();
  if (max_surfaces > 0 && !lights.empty())
    emit(parts, lights, randoms);
  else
    paths_.clear(), rays_.clear();
  for (int depth = 0; !paths_.empty() && !context.stopped(); ++depth) {
    if (ray_hits_.size() < rays_.size()) ray_hits_.resize(rays_.size());
    scene.nearest(rays_, ray_hits_, false);
    context.n_rays += rays_.size();
    size_t n_kept = 0;
    for (size_t i = 0; i < paths_.size(); ++i) {
      if (!ray_hits_[i].found()) continue;
      Path path = paths_[i];
      Ray ray = rays_[i];
      SurfaceHit hit;
      scene.resolve(ray, ray_hits_[i], hit);
      const double cosine = mis_cosine(hit.ng, ray.d);
      path.sums = depth == 0 ? first_sums(scene, mis, starts_[path.index], path, ray, hit, cosine)
                             : mis.arrive(path.sums, cosine, length_squared(hit.p - path.previous_p));
      const bool last = path.ends || depth + 1 >= max_surfaces;
      if (!scatter(parts, mis, randoms[path.index], depth, last, depth + 1 >= rr_depth, hit, path, ray)) continue;
      paths_[n_kept] = path, rays_[n_kept] = ray;
      ++n_kept;
    }
    paths_.resize(n_kept), rays_.resize(n_kept);
  }
  vertices_.finish();
}

template <typename Parts>
bool LightSubpaths::scatter(const Parts& parts, const BidirectionalMis& mis, const PathRandom& random, int depth,
                            bool last, bool roulette, const SurfaceHit& hit, Path& path, Ray& ray) {
  const Vec3 wo = hit.frame.to_local(-ray.d), ng = hit.frame.to_local(hit.ng);
  const bool smooth = hit.bsdf_flags & kSmooth;
  // Mirrors and glass are counted separately, as on camera subpaths.
  const uint32_t vertex = smooth ? kFirstSurfaceVertex + path.n_smooth++ : kDeltaVertices + depth;
  if (last && !smooth) return false;
  const BsdfClosure* bsdf = closures_.bind(hit, wo.z > 0, parts.light_mode());
  if (smooth)
    vertices_.append(path.index, {hit.p, hit.ng, hit.offset, hit.frame, ng, wo, bsdf, path.throughput, path.sums,
                                  static_cast<uint32_t>(depth) + 2, vertex, hit.emitter != nullptr});
  if (last) return false;
  const BsdfSample next =
      bsdf->sample(wo, random.get_1d(vertex, Event::kLobe), random.get_2d(vertex, Event::kDirection));
  if (!next.valid() || is_black(next.weight)) return false;
  path.throughput *= next.weight * parts.adjoint_factor(wo, next.wi, ng);
  if (roulette) {
    // Roulette for independent numbers even if they are common: all pixels then share the subpath, whatever its length.
    const float survival = parts.survival_probability(path.throughput * path.scale, 1, Sampling::kIndependent);
    if (random.get_1d(vertex, Event::kRoulette) < survival)
      path.throughput *= parts.survivor_weight(survival);
    else if (std::isnan(survival))
      path.ends = true;  // connect once more, so that the samples become bad ones instead of black
    else
      return false;
  }
  const Vec3 wi = hit.frame.to_world(next.wi);
  path.sums = mis.leave(path.sums, mis_cosine(hit.ng, wi), scatter_pdfs(*bsdf, wo, next));
  path.previous_p = hit.p;
  ray = {offset_origin(hit, wi), wi, kInfinity};
  return true;
}

}  // namespace covary
