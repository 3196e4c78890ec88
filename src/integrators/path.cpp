// SPDX-License-Identifier: Apache-2.0
// `path`: unidirectional path tracing. At each vertex one light sample (next-event estimation) and one BSDF sample are
// combined by multiple importance sampling with the power heuristic [Veach1997] §9.2; Russian roulette.
//
// | parameter     | type    | default | meaning                                                    |
// |---------------|---------|---------|------------------------------------------------------------|
// | max_depth     | integer | -1      | largest number of path edges; -1: no limit                 |
// | rr_depth      | integer | 5       | number of edges after which roulette may end a path        |
// | hide_emitters | boolean | false   | lights are invisible to the camera                         |
//
// The estimator is unbiased. A surface with a null lobe (mask, null) blocks light samples; light behind it is found by
// paths that pass straight through, which carry full weight because no light sample could have found it.
#include <memory>
#include <vector>

#include "core/error.h"
#include "core/in_place.h"
#include "integrators/integrator.h"
#include "integrators/light_selection.h"
#include "integrators/primary_sample.h"

namespace covary {
namespace {

/// Power heuristic for the technique of density `a` against one of density `b`.
float mis_weight(float a, float b) {
  const float r = b / a;
  return 1 / (1 + r * r);
}

/// mis_weight(a, b) / a by one division, in double precision because squares of densities leave the range of float.
float mis_weight_over_pdf(float a, float b) {
  const double x = a, y = b;
  return static_cast<float>(x / (x * x + y * y));
}

/// First address of the vertices on surfaces that have delta lobes only.
constexpr uint32_t kDeltaVertices = 1u << 20;

/// What a path that goes on carries.
struct Path {
  Spectrum throughput{1};
  float eta = 1;               // product of relative indices, undoes the radiance scaling in roulette
  Vec3 previous_p;             // where the last BSDF sample started
  float previous_pdf = 1;      // its density per unit solid angle
  bool previous_delta = true;  // it came from a delta lobe or the camera
  bool only_null = true;       // nothing but null surfaces met so far
  bool found = false;          // whether the ray hit a surface
  uint32_t sample = 0;         // which of the batch
  uint32_t n_smooth = 0;       // vertices so far on surfaces that have more than delta lobes
};

/// Which light a vertex samples, and with which numbers.
struct LightChoice {
  const Emitter* emitter = nullptr;  // null: the surface cannot use light samples
  Vec2 u;
  float u_primitive = 0;
};

/// A light sample that counts if nothing lies between.
struct Connection {
  Spectrum radiance;
  uint32_t sample;
};

/// The paths that are alive, and for each of them what the loops hand on to one another.
struct Batch {
  /// Makes room for n fresh paths; what else the arrays hold is old and is overwritten before it is read.
  void start(size_t n) {
    paths.resize(n), rays.resize(n);
    for (Path& path : paths) make_in_place(path, [] { return Path(); });
    if (hits.size() < n) ray_hits.resize(n), hits.resize(n), choices.resize(n), lights.resize(n);
    if (blocked.size() < n) blocked.resize(n), connections.resize(n), shadow_rays.resize(n);
    n_connections = 0;
  }
  /// Keeps the first n paths.
  void resize(size_t n) { paths.resize(n), rays.resize(n); }

  std::vector<Path> paths;
  std::vector<Ray> rays;  // the next one of each path
  std::vector<RayHit> ray_hits;
  std::vector<SurfaceHit> hits;
  std::vector<LightChoice> choices;
  std::vector<EmitterSample> lights;
  size_t n_connections = 0;
  std::vector<Connection> connections;
  std::vector<Ray> shadow_rays;  // one of each connection
  std::vector<uint8_t> blocked;
  std::vector<uint32_t> alive;  // places of the paths that go on
};

class PathIntegrator final : public Integrator {
 public:
  explicit PathIntegrator(const PathLengthSettings& lengths) : lengths_(lengths) {}

  // All paths of the batch advance together, one edge at a time, in short loops whose iterations do not depend on each
  // other: while one waits for memory or a division, the processor works on the next.
  void trace(const Scene& scene, std::span<CameraSample> samples, PathContext& context) const override {
    if (lengths_.max_depth <= 0) return;
    thread_local Batch batch;  // kept from call to call: clearing its arrays would take a tenth of the time of a path
    batch.start(samples.size());
    for (uint32_t i = 0; i < samples.size(); ++i) batch.rays[i] = samples[i].ray, batch.paths[i].sample = i;

    for (int depth = 0; !batch.paths.empty(); ++depth) {
      find_surfaces(scene, depth, batch, context);
      if (depth + 1 >= lengths_.min_depth)
        for (size_t i = 0; i < batch.paths.size(); ++i)
          samples[batch.paths[i].sample].radiance += emission(scene, batch.paths[i], batch.rays[i], batch.hits[i]);
      if (depth + 1 >= lengths_.max_depth) break;
      end_paths_without_surface(batch);

      const bool connect = depth + 2 >= lengths_.min_depth && !scene.emitters().empty();
      if (connect) sample_lights(scene, samples, batch);
      scatter(scene, depth, connect, samples, batch, context);
      trace_connections(scene, samples, batch, context);
    }
  }

  std::string description() const override { return "path " + lengths_.text(); }

 private:
  /// Nearest hits of all rays.
  void find_surfaces(const Scene& scene, int depth, Batch& batch, PathContext& context) const {
    const size_t n = batch.paths.size();
    scene.nearest(batch.rays, batch.ray_hits, depth == 0);
    context.n_rays += n;
    for (size_t i = 0; i < n; ++i) {
      batch.paths[i].found = batch.ray_hits[i].found();
      if (!batch.paths[i].found) continue;
      scene.resolve(batch.rays[i], batch.ray_hits[i], batch.hits[i]);
      if (const Texture* texture = batch.hits[i].shape->main_texture()) texture->prefetch(batch.hits[i].uv);
    }
    if (lengths_.hide_emitters && depth == 0)
      for (size_t i = 0; i < n; ++i) skip_area_lights(scene, batch.paths[i], batch.rays[i], batch.hits[i], context);
  }

  static void end_paths_without_surface(Batch& batch) {
    size_t n_kept = 0;
    for (size_t i = 0; i < batch.paths.size(); ++i) {
      if (!batch.paths[i].found) continue;
      if (n_kept != i)
        batch.paths[n_kept] = batch.paths[i], batch.rays[n_kept] = batch.rays[i], batch.hits[n_kept] = batch.hits[i];
      ++n_kept;
    }
    batch.resize(n_kept);
  }

  /// One light sample for each vertex whose surface can use it. All choices come first, so that memory answers to one
  /// while the others are made.
  static void sample_lights(const Scene& scene, std::span<const CameraSample> samples, Batch& batch) {
    for (size_t i = 0; i < batch.paths.size(); ++i) {
      batch.choices[i].emitter = nullptr;
      if (!(batch.hits[i].bsdf_flags & kSmooth)) continue;
      const PathRandom& random = samples[batch.paths[i].sample].random;
      const uint32_t vertex = kFirstSurfaceVertex + batch.paths[i].n_smooth;
      const Emitter& emitter = select_light(scene, random.get_1d(vertex, Event::kLightChoice));
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
      const LightChoice& choice = batch.choices[i];
      if (!choice.emitter)
        batch.lights[i].pdf_solid_angle = 0;
      else
        make_in_place(batch.lights[i],
                      [&] { return choice.emitter->sample_towards(batch.hits[i].p, choice.u, choice.u_primitive); });
    }
  }

  /// Evaluates the surfaces: connections to the light samples, and the next rays. Paths that end are removed.
  void scatter(const Scene& scene, int depth, bool connect, std::span<const CameraSample> samples, Batch& batch,
               PathContext& context) const {
    batch.alive.clear();
    for (uint32_t i = 0; i < batch.paths.size(); ++i) {
      Path& path = batch.paths[i];
      const SurfaceHit& hit = batch.hits[i];
      const PathRandom& random = samples[path.sample].random;
      const Vec3 wo = hit.frame.to_local(-batch.rays[i].d);
      // Mirrors and glass have addresses of their own: a path that met one reads, at the surfaces behind it, the same
      // numbers as its neighbour that did not.
      const uint32_t vertex = hit.bsdf_flags & kSmooth ? kFirstSurfaceVertex + path.n_smooth++ : kDeltaVertices + depth;
      context.arena.reset();
      const BsdfClosure* bsdf = hit.bsdf->bind(hit, wo.z > 0, TransportMode::kRadiance, context.arena);
      if (connect && batch.lights[i].pdf_solid_angle > 0)
        connect_light(scene, path, hit, wo, *bsdf, batch.lights[i], batch);

      const BsdfSample next =
          bsdf->sample(wo, random.get_1d(vertex, Event::kLobe), random.get_2d(vertex, Event::kDirection));
      if (!next.valid() || is_black(next.weight)) continue;
      path.throughput *= next.weight;
      path.eta *= next.eta;
      if (!(next.flags & kNullTransmission)) path.only_null = false;
      if (depth + 1 >= lengths_.rr_depth) {
        const float survival = survival_probability(path, random.sampling());
        if (random.get_1d(vertex, Event::kRoulette) >= survival) continue;
        path.throughput *= 1 / survival;
      }
      const Vec3 wi = hit.frame.to_world(next.wi);
      path.previous_p = hit.p;
      path.previous_pdf = next.pdf;
      path.previous_delta = next.is_delta();
      make_in_place(batch.rays[i], [&] { return Ray{offset_origin(hit.p, hit.ng, wi), wi, kInfinity}; });
      batch.alive.push_back(i);
    }
    for (size_t n = 0; n < batch.alive.size(); ++n)
      if (const uint32_t i = batch.alive[n]; i != n) batch.paths[n] = batch.paths[i], batch.rays[n] = batch.rays[i];
    batch.resize(batch.alive.size());
  }

  /// Adds the light samples that nothing hides.
  static void trace_connections(const Scene& scene, std::span<CameraSample> samples, Batch& batch,
                                PathContext& context) {
    scene.occluded(std::span(batch.shadow_rays).first(batch.n_connections), batch.blocked);
    context.n_rays += batch.n_connections;
    for (size_t i = 0; i < batch.n_connections; ++i)
      if (!batch.blocked[i]) samples[batch.connections[i].sample].radiance += batch.connections[i].radiance;
    batch.n_connections = 0;
  }

  /// Roulette after the brightest channel, as if refraction had not scaled radiance. With common random numbers its
  /// fourth root: few paths with large weights are what neighbouring pixels share least, so longer paths pay off there
  /// (docs/performance.md, "Roulette").
  static float survival_probability(const Path& path, Sampling sampling) {
    const float brightest = max_component(path.throughput) * sqr(path.eta);
    return std::min(sampling == Sampling::kCrn ? std::sqrt(std::sqrt(brightest)) : brightest, 0.95f);
  }

  /// Contribution of what the path's ray met, weighted against light sampling.
  Spectrum emission(const Scene& scene, const Path& path, const Ray& ray, const SurfaceHit& hit) const {
    const Emitter* emitter = path.found ? hit.emitter : scene.environment();
    if (!emitter || (!path.found && lengths_.hide_emitters && path.only_null)) return {};
    const EnvironmentLight light =
        path.found ? EnvironmentLight{emitter->surface_radiance(hit, -ray.d)} : emitter->environment(ray.d);
    const Spectrum radiance = path.throughput * light.radiance;
    if (path.previous_delta || is_black(radiance)) return radiance;
    const float pdf_light = path.found ? emitter->pdf_solid_angle(path.previous_p, hit) : light.pdf_solid_angle;
    return radiance * mis_weight(path.previous_pdf, light_pmf(scene) * pdf_light);
  }

  /// Next-event estimation: f cos L / pdf, weighted against BSDF sampling, if nothing lies between.
  static void connect_light(const Scene& scene, const Path& path, const SurfaceHit& hit, const Vec3& wo,
                            const BsdfClosure& bsdf, const EmitterSample& light, Batch& batch) {
    if (is_black(light.radiance)) return;
    const BsdfValue f = bsdf.eval(wo, hit.frame.to_local(light.wi));
    if (is_black(f.value)) return;
    const float pdf = light_pmf(scene) * light.pdf_solid_angle;
    const float weight = light.is_delta ? 1 / pdf : mis_weight_over_pdf(pdf, f.pdf_solid_angle);
    const size_t n = batch.n_connections++;
    make_in_place(batch.connections[n], [&] {
      return Connection{path.throughput * f.value * light.radiance * weight, path.sample};
    });
    make_in_place(batch.shadow_rays[n], [&] { return shadow_ray(hit, light); });
  }

  /// Follows the camera ray past area lights until something else is hit.
  static void skip_area_lights(const Scene& scene, Path& path, Ray& ray, SurfaceHit& hit, PathContext& context) {
    while (path.found && hit.emitter) {
      ray.o = offset_origin(hit.p, hit.ng, ray.d);
      ray.t_max -= hit.t;
      ++context.n_rays;
      path.found = scene.intersect(ray, hit);
    }
  }

  PathLengthSettings lengths_;
};

}  // namespace

std::shared_ptr<Integrator> make_path(Parameters&, const PathLengthSettings& lengths) {
  return std::make_shared<PathIntegrator>(lengths);
}

}  // namespace covary
