// SPDX-License-Identifier: Apache-2.0
// `direct`: directly visible emission and direct light, by several light samples and several direction samples of the
// first surface, combined by multiple importance sampling with the power heuristic [Veach1997] §9.2. With N and M
// samples, densities are weighted by N / (N + M) and M / (N + M), as in Mitsuba. Without light samples, point and
// directional lights are black; without direction samples, mirrors are.
#include "integrators/path_lengths.h"
#include "integrators/path_steps.h"
#include "passes/integrator.h"
#include "sampling/light_selection.h"
#include "sampling/mis.h"

namespace covary {
namespace {

constexpr int kMaxSamples = 1 << 16;

struct DirectSettings {
  int shading_samples = 1, emitter_samples = 1, bsdf_samples = 1;
};

class DirectIntegrator final : public Integrator {
 public:
  DirectIntegrator(const DirectSettings& settings, const PathLengthSettings& lengths)
      : settings_(settings), lengths_(lengths) {
    const float n = static_cast<float>(settings.emitter_samples), m = static_cast<float>(settings.bsdf_samples);
    light_share_ = n / (n + m), direction_share_ = m / (n + m);
  }

  std::shared_ptr<Integrator> clone() const override { return std::make_shared<DirectIntegrator>(settings_, lengths_); }
  std::unique_ptr<ThreadState> make_thread_state() const override { return std::make_unique<PathBatch>(); }

  void trace(const Scene& scene, std::span<CameraSample> samples, PathContext& context) const override {
    if (lengths_.max_depth <= 0) return;
    PathBatch& batch = context.state_as<PathBatch>();
    const UniformLights lights(scene);
    start_paths(samples, batch);
    find_surfaces(scene, 0, lengths_.hide_emitters, batch, context);
    if (lengths_.min_depth <= 1)
      for (size_t i = 0; i < batch.paths.size(); ++i)
        samples[batch.paths[i].sample].radiance += seen_directly(scene, batch, i);
    if (lengths_.max_depth < 2 || lengths_.min_depth > 2 || lights.empty()) return;
    keep_paths(batch, [](const PathState& path) { return path.found; });
    for (int k = 0; k < settings_.emitter_samples && !context.stopped(); ++k)
      sample_light(scene, lights, static_cast<uint32_t>(k), samples, batch, context);
    for (int k = 0; k < settings_.bsdf_samples && !context.stopped(); ++k)
      sample_direction(scene, lights, static_cast<uint32_t>(k), samples, batch, context);
  }

  std::string description() const override {
    return "direct emitter_samples=" + std::to_string(settings_.emitter_samples) +
           " bsdf_samples=" + std::to_string(settings_.bsdf_samples) + " " + lengths_.text();
  }

 private:
  Spectrum seen_directly(const Scene& scene, const PathBatch& batch, size_t i) const {
    const PathState& path = batch.paths[i];
    const SurfaceHit& hit = batch.hits[i];
    const Emitter* emitter = emitter_met(path, hit, scene, scene.environment(), lengths_.hide_emitters);
    return emitter ? emitted_light(*emitter, path, batch.rays[i], hit).radiance : Spectrum();
  }

  const BsdfClosure& bind(const SurfaceHit& hit, const Vec3& wo, PathContext& context) const {
    context.arena.reset();
    return *hit.bsdf->bind(hit, wo.z > 0, TransportMode::kRadiance, context.arena);
  }

  /// Takes light sample k for every path.
  void sample_light(const Scene& scene, const UniformLights& lights, uint32_t k, std::span<CameraSample> samples,
                    PathBatch& batch, PathContext& context) const {
    for (PathBatch::Path& path : batch.paths) path.n_smooth = k;  // the address of the numbers
    sample_lights(scene, lights, samples, batch);
    const float each = 1 / static_cast<float>(settings_.emitter_samples);
    batch.n_connections = 0;
    for (size_t i = 0; i < batch.paths.size(); ++i) {
      const EmitterSample& light = batch.lights[i];
      const SurfaceHit& hit = batch.hits[i];
      if (!(light.pdf_solid_angle > 0) || is_black(light.radiance)) continue;
      const Vec3 wo = hit.frame.to_local(-batch.rays[i].d);
      const BsdfValue f = bind(hit, wo, context).eval(wo, hit.frame.to_local(light.wi));
      if (is_black(f.value)) continue;
      const float pdf = lights.pmf(*batch.choices[i]) * light.pdf_solid_angle;
      const float weight = light.is_delta ? 1 : mis::power(pdf * light_share_, f.pdf_solid_angle * direction_share_);
      const size_t n = batch.n_connections++;
      batch.connections[n] = {f.value * light.radiance * (weight * each / pdf), batch.paths[i].sample};
      batch.shadow_rays[n] = shadow_ray(hit, light);
    }
    add_connections(scene, samples, batch, context);
  }

  /// Takes direction sample k for every path.
  void sample_direction(const Scene& scene, const UniformLights& lights, uint32_t k, std::span<CameraSample> samples,
                        const PathBatch& batch, PathContext& context) const {
    const float each = 1 / static_cast<float>(settings_.bsdf_samples);
    for (size_t i = 0; i < batch.paths.size(); ++i) {
      const SurfaceHit& hit = batch.hits[i];
      const Vec3 wo = hit.frame.to_local(-batch.rays[i].d);
      const uint32_t vertex = (hit.bsdf_flags & kSmooth ? kFirstSurfaceVertex : kDeltaVertices) + k;
      const PathRandom& random = samples[batch.paths[i].sample].random;
      const BsdfSample next =
          bind(hit, wo, context)
              .sample(wo, random.get_1d(vertex, Event::kLobe), random.get_2d(vertex, Event::kDirection));
      if (!next.valid() || is_black(next.weight)) continue;
      const Vec3 wi = hit.frame.to_world(next.wi);
      Ray ray{offset_origin(hit, wi), wi, kInfinity};
      const bool passes = next.flags & kNullTransmission;
      const Emitter* environment = passes && scene.background()       ? scene.background()
                                   : passes && lengths_.hide_emitters ? nullptr
                                                                      : scene.environment();
      const Found found = light_along(scene, lights, hit.p, ray, environment, context);
      if (is_black(found.radiance)) continue;
      const float weight = next.is_delta() ? 1 : mis::power(next.pdf * direction_share_, found.pdf * light_share_);
      samples[batch.paths[i].sample].radiance += next.weight * found.radiance * (weight * each);
    }
  }

  struct Found {
    Spectrum radiance;
    float pdf = 0;  // density of finding it by light samples
  };
  static Found light_along(const Scene& scene, const UniformLights& lights, const Vec3& from, const Ray& ray,
                           const Emitter* environment, PathContext& context) {
    SurfaceHit hit;
    ++context.n_rays;
    if (scene.intersect(ray, hit)) {
      if (!hit.emitter) return {};
      return {hit.emitter->surface_radiance(hit, -ray.d),
              lights.pmf(*hit.emitter) * hit.emitter->pdf_solid_angle(from, hit)};
    }
    if (!environment) return {};
    const EnvironmentLight light = environment->environment(ray.d);
    if (environment == scene.background()) return {light.radiance};
    return {light.radiance, lights.pmf(*environment) * light.pdf_solid_angle};
  }

  DirectSettings settings_;
  PathLengthSettings lengths_;
  float light_share_, direction_share_;
};

}  // namespace

std::shared_ptr<Integrator> make_direct(Settings& s, const PathLengthSettings& lengths) {
  static const OptionTraits kOfScene{.level = OptionLevel::kScene};
  DirectSettings v;
  s.group("Direct light", OptionEffect::kSamples);
  s.whole("shading-samples", v.shading_samples, {.low = 1, .high = kMaxSamples},
          "Light samples and BSDF samples per camera sample", kOfScene);
  v.emitter_samples = v.bsdf_samples = v.shading_samples;
  s.whole("emitter-samples", v.emitter_samples, {.low = 0, .high = kMaxSamples}, "Light samples, if different",
          kOfScene);
  s.whole("bsdf-samples", v.bsdf_samples, {.low = 0, .high = kMaxSamples}, "BSDF samples, if different", kOfScene);
  if (v.emitter_samples + v.bsdf_samples == 0)
    throw Error(ErrorCode::kInput, "emitter_samples and bsdf_samples are both 0; there must be a sample");
  return std::make_shared<DirectIntegrator>(v, lengths);
}

}  // namespace covary
