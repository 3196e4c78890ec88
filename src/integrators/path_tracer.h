// SPDX-License-Identifier: Apache-2.0
// Unidirectional path tracing with replaceable parts. At each vertex, one light sample (next-event estimation) and one
// direction sample are combined by multiple importance sampling [Veach1997] §9.2; Russian roulette ends paths.
//
// Unbiased. A surface with a null lobe (mask, null) blocks light samples; light behind it is found by paths that pass
// straight through, with full weight because no light sample could have found it.
#pragma once

#include <cmath>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>

#include "core/in_place.h"
#include "integrators/path_steps.h"
#include "integrators/primary_sample.h"
#include "passes/integrator.h"
#include "sampling/light_selection.h"
#include "sampling/mis.h"
#include "sampling/roulette.h"

namespace covary {

/// The parts of `path`. Others derive from it and hide the functions they replace; calls are resolved when the template
/// below is compiled, so replacing one costs nothing. Many threads share one object; all functions are const except
/// prepare().
struct PathParts : roulette::Parts {
  /// Whether light selection, directions, their weights and roulette are the ones below, so that Lambertian vertices
  /// may be shaded in blocks, which use the same.
  static constexpr bool kInBlocks = false;

  /// Called before the first path.
  void prepare(const Scene&) {}

  /// For separating radiance by light: called when a batch of samples begins, when a light adds to the radiance of a
  /// sample, and to record and look up the light of connection number n of the batch.
  void begin(size_t /*n_samples*/, PathContext&) const {}
  void add_light(const Emitter* /*light*/, uint32_t /*sample*/, const Spectrum& /*radiance*/, PathContext&) const {}
  void connect_with(const Emitter& /*light*/, size_t /*n*/, PathBatch&) const {}
  const Emitter* light_of(size_t /*n*/, const PathBatch&) const { return nullptr; }

  /// Light selection; see UniformLights for the required interface.
  UniformLights lights(const Scene& scene) const { return UniformLights(scene); }

  /// Samples the direction in which a path continues from `hit`, reading the random numbers of `vertex`. With guiding,
  /// another distribution is mixed in; pdf is then that of the mixture.
  BsdfSample sample_direction(const BsdfClosure& bsdf, const SurfaceHit& /*hit*/, const Vec3& wo,
                              const PathRandom& random, uint32_t vertex) const {
    return bsdf.sample(wo, random.get_1d(vertex, Event::kLobe), random.get_2d(vertex, Event::kDirection));
  }
  /// BSDF value, and the density with which sample_direction() samples `wi`, without delta lobes.
  BsdfValue eval_direction(const BsdfClosure& bsdf, const SurfaceHit& /*hit*/, const Vec3& wo, const Vec3& wi) const {
    return bsdf.eval(wo, wi);
  }

  /// Weight of light found by a direction sample of density `pdf`, which light sampling finds with `pdf_light`.
  float direction_weight(float pdf, float pdf_light) const { return mis::power(pdf, pdf_light); }
  /// Weight of a light sample over its density `pdf_light`; direction sampling finds it with `pdf`.
  float light_weight_over_pdf(bool is_delta, float pdf_light, float pdf) const {
    return is_delta ? 1 / pdf_light : mis::power_over_pdf(pdf_light, pdf);
  }
};

/// The integrator built from `Parts`, which has the functions of PathParts.
template <typename Parts>
class PathTracer final : public Integrator {
 public:
  /// `name`: as registered.
  PathTracer(std::string name, const PathLengthSettings& lengths, Parts parts = {})
      : name_(std::move(name)), lengths_(lengths), parts_(std::move(parts)) {}

  std::shared_ptr<Integrator> clone() const override { return std::make_shared<PathTracer>(name_, lengths_, parts_); }
  void prepare(const Scene& scene) override { parts_.prepare(scene); }
  std::unique_ptr<ThreadState> make_thread_state() const override { return std::make_unique<PathBatch>(); }

  void trace(const Scene& scene, std::span<CameraSample> samples, PathContext& context) const override {
    if (lengths_.max_depth <= 0) return;
    PathBatch& batch = context.state_as<PathBatch>();
    parts_.begin(samples.size(), context);
    start_paths(samples, batch);
    follow_paths(scene, lengths_, samples, batch, context,
                 Steps{*this, scene, parts_.lights(scene), samples, batch, context});
  }

  std::string description() const override { return name_ + " " + lengths_.text(); }

 private:
  /// Steps of follow_paths().
  struct Steps {
    using Path = PathBatch::Path;
    using Lights = decltype(std::declval<const Parts&>().lights(std::declval<const Scene&>()));

    const PathTracer& tracer;
    const Scene& scene;
    const Lights lights;
    std::span<CameraSample> samples;
    PathBatch& batch;
    PathContext& context;
    bool connecting = false;  ///< vertices take light samples

    void arrive(int depth, size_t i) {
      if (depth + 1 < tracer.lengths_.min_depth) return;
      const Path& path = batch.paths[i];
      const Spectrum radiance = emission(path, batch.rays[i], batch.hits[i]);
      samples[path.sample].radiance += radiance;
      tracer.parts_.add_light(path.found ? batch.hits[i].emitter : scene.environment(), path.sample, radiance, context);
    }

    bool goes_on(int /*depth*/, const Path& /*path*/) const { return true; }

    void sample_lights(int depth) {
      connecting = depth + 2 >= tracer.lengths_.min_depth && !lights.empty();
      if (connecting) covary::sample_lights(scene, lights, samples, batch);
    }

    bool scatter(int depth, uint32_t i, const PathVertex& vertex) {
      Path& path = batch.paths[i];
      if (connecting && batch.lights[i].pdf_solid_angle > 0)
        connect_light(*batch.choices[i], path, vertex, batch.lights[i]);

      const BsdfSample next =
          tracer.parts_.sample_direction(vertex.bsdf, vertex.hit, vertex.wo, vertex.sample.random, vertex.address);
      if (!next.valid() || is_black(next.weight)) return false;
      scatter_path(path, next);
      if (depth + 1 >= tracer.lengths_.rr_depth) {
        const float weight = play_roulette(tracer.parts_, path, path.throughput, vertex.address, vertex.sample);
        if (!(weight > 0)) return false;
        path.throughput *= weight;
      }
      continue_path(path, batch.rays[i], vertex.hit, next, vertex.hit.frame.to_world(next.wi));
      return true;
    }

    /// Lambertian mesh vertices, which are shaded in blocks.
    bool defers(const Ray& ray, const RayHit& hit) { return Parts::kInBlocks && batch.meshes.find(scene, ray, hit); }

    void scatter_deferred(int depth, uint32_t i) {
      LambertianBlock& block = batch.block;
      Path& path = batch.paths[i];
      block.add(i, path.throughput, path.eta, batch.rays[i], batch.ray_hits[i], batch.meshes.at(batch.ray_hits[i]),
                samples[path.sample].random, kFirstSurfaceVertex + path.n_smooth++);
      if (block.full()) finish_deferred(depth);
    }

    /// Connects and scatters the vertices of the block.
    void finish_deferred(int depth) {
      LambertianBlock& block = batch.block;
      if (block.size() == 0) return;
      block.find_surfaces();
      block.draw_numbers();
      if (connecting) connect_block(block);
      block.scatter();
      const bool roulette = depth + 1 >= tracer.lengths_.rr_depth;
      if (roulette) block.survive(samples[0].random.sampling());
      for (int l = 0; l < block.size(); ++l) {
        const uint32_t i = block.index[l];
        Path& path = batch.paths[i];
        path.throughput = block.throughput[l];
        if (!(block.pdf[l] > 0)) {
          if (roulette && std::isnan(block.survival[l])) samples[path.sample].radiance = path.throughput;
          continue;
        }
        batch.goes_on[i] = true;
        path.previous_p = block.p[l], path.previous_pdf = block.pdf[l];
        path.previous_delta = path.only_null = false;
        make_in_place(batch.rays[i], [&] { return Ray{block.o[l], block.d[l], kInfinity}; });
      }
      block.clear();
    }

    void connect_block(LambertianBlock& block) {
      const Emitter* emitters[LambertianBlock::kCapacity];
      for (int l = 0; l < block.size(); ++l) emitters[l] = &lights.select(block.u_choice[l]);
      block.sample_lights(emitters);
      block.connect(lights.pmf(*emitters[0]));
      for (int l = 0; l < block.size(); ++l) {
        if (is_black(block.contribution[l])) continue;
        const size_t n = batch.n_connections++;
        tracer.parts_.connect_with(*emitters[l], n, batch);
        make_in_place(batch.connections[n], [&] {
          return PathBatch::Connection{block.contribution[l], batch.paths[block.index[l]].sample};
        });
        make_in_place(batch.shadow_rays[n], [&] {
          return Ray{block.shadow_o[l], block.shadow_d[l], block.shadow_t[l]};
        });
      }
    }

    void connect(int /*depth*/) {
      visit_connections(scene, batch, context, [&](const PathBatch::Connection& connection, bool hidden) {
        if (hidden) return;
        samples[connection.sample].radiance += connection.radiance;
        const auto n = static_cast<size_t>(&connection - batch.connections.data());
        tracer.parts_.add_light(tracer.parts_.light_of(n, batch), connection.sample, connection.radiance, context);
      });
    }

    /// Contribution of what the path's ray hit, weighted against light sampling.
    Spectrum emission(const Path& path, const Ray& ray, const SurfaceHit& hit) const {
      const Emitter* emitter = emitter_met(path, hit, scene, scene.environment(), tracer.lengths_.hide_emitters);
      if (!emitter) return {};
      const EnvironmentLight light = emitted_light(*emitter, path, ray, hit);
      const Spectrum radiance = path.throughput * light.radiance;
      if (path.previous_delta || is_black(radiance)) return radiance;
      const float pdf_light = path.found ? emitter->pdf_solid_angle(path.previous_p, hit) : light.pdf_solid_angle;
      return radiance * tracer.parts_.direction_weight(path.previous_pdf, lights.pmf(*emitter) * pdf_light);
    }

    /// Next-event estimation: f cos L / pdf, weighted against direction sampling, if unoccluded. `light`: a sample of
    /// `emitter`.
    void connect_light(const Emitter& emitter, const Path& path, const PathVertex& vertex, const EmitterSample& light) {
      if (is_black(light.radiance)) return;
      const SurfaceHit& hit = vertex.hit;
      const BsdfValue f = tracer.parts_.eval_direction(vertex.bsdf, hit, vertex.wo, hit.frame.to_local(light.wi));
      if (is_black(f.value)) return;
      const float pdf_light = lights.pmf(emitter) * light.pdf_solid_angle;
      const float weight = tracer.parts_.light_weight_over_pdf(light.is_delta, pdf_light, f.pdf_solid_angle);
      const size_t n = batch.n_connections++;
      tracer.parts_.connect_with(emitter, n, batch);
      make_in_place(batch.connections[n], [&] {
        return PathBatch::Connection{path.throughput * f.value * light.radiance * weight, path.sample};
      });
      make_in_place(batch.shadow_rays[n], [&] { return shadow_ray(hit, light); });
    }
  };

  std::string name_;
  PathLengthSettings lengths_;
  Parts parts_;
};

}  // namespace covary
