// SPDX-License-Identifier: Apache-2.0
// Bidirectional path tracing with replaceable parts [Veach1997] §10. A camera sample traces a subpath from a light and
// one from the camera, and connects each vertex of one to each vertex of the other; multiple importance sampling
// weights (bdpt_weights.h) divide each path among the techniques (s, t) that find it, with s vertices from the light
// and t from the camera:
//     s = 0   the camera subpath hits a light;
//     s = 1   a light sample, with the numbers and densities that `path` uses;
//     s >= 2  the subpaths are connected;
//     t = 1   a light subpath is connected to the lens: a pass of its own (light_pass.h), if light is traced.
// (1, 1) is left out, since s = 0 finds directly visible lights without noise.
//
// It estimates the same image as `path`. As there, null surfaces are vertices that block connections.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "integrators/bdpt_weights.h"
#include "integrators/bidirectional_parts.h"
#include "integrators/light_subpaths.h"
#include "integrators/path_lengths.h"
#include "integrators/path_steps.h"
#include "passes/light_pass.h"

namespace covary {

/// Per-thread state of bidirectional path tracing.
struct BidirectionalBatch final : ThreadState {
  /// Contribution to a sample if the ray at the same index in `rays` is unoccluded.
  struct Connection {
    Spectrum value;
    float weight;
    uint32_t sample;
    int s, t;
  };
  PathBatch camera;
  std::vector<SubpathSums> sums;  ///< of the camera subpaths, by sample
  LightSubpaths light;
  std::vector<PathRandom> light_randoms;  ///< numbers of the light subpaths in `light`
  std::vector<uint32_t> light_path;       ///< index into these, per sample
  std::vector<Connection> connections;
  std::vector<Ray> rays;
  std::vector<uint8_t> blocked;
};

template <typename Parts>
class BidirectionalTracer final : public LightTracingIntegrator {
 public:
  explicit BidirectionalTracer(const BidirectionalSettings& settings, Parts parts = {})
      : LightTracingIntegrator(settings.light_tracing),
        settings_(settings),
        lengths_(settings.lengths),
        parts_(std::move(parts)) {}

  std::shared_ptr<Integrator> clone() const override {
    return std::make_shared<BidirectionalTracer>(settings_, parts_);
  }
  void prepare(const Scene& scene) override {
    if (scene.camera().is_orthographic())
      throw Error(
          ErrorCode::kInput,
          "integrator bdpt cannot render for an orthographic sensor: no light path finds a camera whose rays are "
          "parallel; use path");
    emission_lights_.emplace(scene);
    to_camera_ = scene.camera().settings().to_world.inverse();
  }
  std::unique_ptr<ThreadState> make_thread_state() const override { return std::make_unique<BidirectionalBatch>(); }

  void trace(const Scene& scene, std::span<CameraSample> samples, PathContext& context) const override {
    if (lengths_.max_depth <= 0) return;
    auto& state = context.state_as<BidirectionalBatch>();
    trace_light_subpaths(scene, samples, state, context);
    PathBatch& batch = state.camera;
    batch.start(samples.size());
    state.sums.resize(samples.size());
    for (uint32_t i = 0; i < samples.size(); ++i) start_path(scene, samples[i], i, state);

    follow_paths(scene, lengths_, samples, batch, context,
                 Steps{*this, scene, UniformLights(scene), samples, state, context});
  }

  void trace_light_paths(const Scene& scene, const LightPaths& paths, std::vector<LightSplat>& splats,
                         PathContext& context) const override {
    auto& state = context.state_as<BidirectionalBatch>();
    state.light_randoms.clear();
    for (uint32_t i = 0; i < paths.count; ++i)
      state.light_randoms.push_back(paths.random(paths.first + i).subpath(Subpath::kLight));
    state.light.trace(parts_, scene, *emission_lights_, mis_, state.light_randoms, max_surfaces(1), lengths_.rr_depth,
                      context);
    for (uint32_t i = 0; i < paths.count; ++i)
      for (const LightVertex& end : state.light.path(i))
        join_to_lens(scene, paths, paths.first + i, end, splats, context);
  }

  std::string description() const override { return "bdpt " + lengths_.text() + " " + light_tracing_text(); }

 private:
  using Path = PathBatch::Path;
  using State = BidirectionalBatch;
  /// A vertex of a camera subpath with its BSDF bound.
  struct CameraVertex {
    const SurfaceHit& hit;
    const Vec3& wo;
    const BsdfClosure& bsdf;
    const Path& path;
    const SubpathSums& sums;
    int t;
  };

  /// Steps of follow_paths() at each edge of camera subpaths.
  struct Steps {
    const BidirectionalTracer& tracer;
    const Scene& scene;
    const UniformLights lights;
    std::span<CameraSample> samples;
    State& state;
    PathContext& context;
    bool use_light_samples = false;

    void arrive(int depth, size_t i) {
      const PathBatch& batch = state.camera;
      if (depth + 1 >= tracer.lengths_.min_depth)
        samples[batch.paths[i].sample].radiance +=
            tracer.emission(scene, lights, depth, batch.paths[i], batch.rays[i], batch.hits[i], state);
    }

    bool goes_on(int /*depth*/, const Path& /*path*/) const { return true; }

    void sample_lights(int depth) {
      use_light_samples = depth + 2 >= tracer.lengths_.min_depth && !lights.empty();
      if (use_light_samples) covary::sample_lights(scene, lights, samples, state.camera);
    }

    bool scatter(int depth, uint32_t i, const PathVertex& at) {
      PathBatch& batch = state.camera;
      Path& path = batch.paths[i];
      SubpathSums& sums = state.sums[path.sample];
      sums =
          tracer.mis_.arrive(sums, mis_cosine(at.hit.ng, batch.rays[i].d), length_squared(at.hit.p - path.previous_p));
      const CameraVertex end{at.hit, at.wo, at.bsdf, path, sums, depth + 2};
      if (use_light_samples && batch.lights[i].pdf_solid_angle > 0)
        tracer.join_to_light(lights.pmf(*batch.choices[i]), *batch.choices[i], batch.lights[i], end, state);
      if (at.hit.bsdf_flags & kSmooth)
        for (const LightVertex& light : state.light.path(state.light_path[path.sample])) tracer.join(light, end, state);
      return tracer.go_on(depth, at, path, sums, batch.rays[i]);
    }

    void connect(int /*depth*/) { tracer.trace_connections(scene, samples, state, context); }
  };

  /// Maximum number of surfaces a light subpath needs when connected to t vertices from the camera.
  int max_surfaces(int t) const { return std::min(lengths_.max_depth - t, parts_.max_light_vertices() - 1); }

  /// With common random numbers, all pixels share a sample's light subpath: it is traced once and kept for the
  /// following batches.
  void trace_light_subpaths(const Scene& scene, std::span<const CameraSample> samples, State& state,
                            PathContext& context) const {
    std::vector<PathRandom>& kept = state.light_randoms;
    state.light_path.clear();
    for (const CameraSample& sample : samples) {
      const uint32_t guess = state.light_path.empty() ? 0 : state.light_path.back() + 1;
      const uint32_t place = place_of(sample.random.subpath(Subpath::kLight), guess, kept);
      if (place == kept.size()) break;
      state.light_path.push_back(place);
    }
    if (state.light_path.size() == samples.size()) return;
    kept.clear(), state.light_path.clear();
    for (const CameraSample& sample : samples) {
      const PathRandom random = sample.random.subpath(Subpath::kLight);
      const uint32_t guess = state.light_path.empty() ? 0 : state.light_path.back() + 1;
      const uint32_t place = place_of(random, guess, kept);
      if (place == kept.size()) kept.push_back(random);
      state.light_path.push_back(place);
    }
    state.light.trace(parts_, scene, *emission_lights_, mis_, kept, max_surfaces(2), lengths_.rr_depth, context);
  }

  /// Index of a light subpath among the kept ones, or their number. All samples of a pixel come in order, followed by
  /// those of the next pixel.
  static uint32_t place_of(const PathRandom& random, size_t guess, const std::vector<PathRandom>& kept) {
    if (random.sampling() != Sampling::kCrn) return static_cast<uint32_t>(kept.size());
    if (guess < kept.size() && kept[guess] == random) return static_cast<uint32_t>(guess);
    return static_cast<uint32_t>(std::find(kept.begin(), kept.end(), random) - kept.begin());
  }

  void start_path(const Scene& scene, const CameraSample& sample, uint32_t i, State& state) const {
    Path& path = state.camera.paths[i];
    state.camera.rays[i] = sample.ray;
    path.sample = i;
    state.sums[i] = {};
    if (!traces_light()) return;
    // The ray starts on the near plane, but densities are relative to the lens.
    const Vec3& d = sample.ray.d;
    path.previous_p = sample.ray.o - d * (scene.camera().settings().near_clip / to_camera_.vector(d).z);
    state.sums[i].vcm = mis_.raised(light_paths_per_spp() / scene.camera().pdf_direction(d));
  }

  /// s = 0: contribution of what the path's ray hit.
  Spectrum emission(const Scene& scene, const UniformLights& lights, int depth, const Path& path, const Ray& ray,
                    const SurfaceHit& hit, const State& state) const {
    const Emitter* emitter = emitter_met(path, hit, scene, scene.environment(), lengths_.hide_emitters);
    if (!emitter) return {};
    const EnvironmentLight light = emitted_light(*emitter, path, ray, hit);
    const Spectrum radiance = path.throughput * light.radiance;
    if (is_black(radiance)) return {};
    const SubpathSums& left = state.sums[path.sample];
    double weight = 1;
    if (depth > 0 && left.any() && emitter != scene.background()) {
      const float pdf_light = path.found ? emitter->pdf_solid_angle(path.previous_p, hit) : light.pdf_solid_angle;
      const LightPdfs pdfs =
          light_pdfs(*emitter, lights.pmf(*emitter), pdf_light, emission_lights_->pmf(*emitter),
                     emitter->pdf_emission(hit, -ray.d), hit.ng, ray.d, length_squared(hit.p - path.previous_p));
      weight = 1 / (1 + mis_.others_of_hit(left, pdfs));
    }
    parts_.record(0, depth + 2, radiance, weight);
    return radiance * static_cast<float>(weight);
  }

  /// Samples the next ray of a camera subpath; false if the path ends.
  bool go_on(int depth, const PathVertex& at, Path& path, SubpathSums& sums, Ray& ray) const {
    const PathRandom& random = at.sample.random;
    const BsdfSample next =
        at.bsdf.sample(at.wo, random.get_1d(at.address, Event::kLobe), random.get_2d(at.address, Event::kDirection));
    if (!next.valid() || is_black(next.weight)) return false;
    scatter_path(path, next);
    if (depth + 1 >= lengths_.rr_depth) {
      const float weight = play_roulette(parts_, path, path.throughput, at.address, at.sample);
      if (!(weight > 0)) return false;
      path.throughput *= weight;
    }
    const Vec3 wi = at.hit.frame.to_world(next.wi);
    sums = mis_.leave(sums, mis_cosine(at.hit.ng, wi), scatter_pdfs(at.bsdf, at.wo, next));
    if (parts_.max_light_vertices() == 1) sums.vc = 0;
    path.previous_p = at.hit.p;
    make_in_place(ray, [&] { return Ray{offset_origin(at.hit, wi), wi, kInfinity}; });
    return true;
  }

  /// s = 1.
  void join_to_light(float pmf, const Emitter& emitter, const EmitterSample& light, const CameraVertex& end,
                     State& state) const {
    if (is_black(light.radiance)) return;
    const Vec3 wi = end.hit.frame.to_local(light.wi);
    const BsdfValue f = end.bsdf.eval(end.wo, wi);
    if (is_black(f.value)) return;
    double others = 0;
    if (parts_.max_light_vertices() > 1 && end.sums.any()) {
      const EmissionPdf emission = emitter.pdf_emission(point_on_light(light.p, light.n, light.uv), -light.wi);
      const LightPdfs pdfs = light_pdfs(emitter, pmf, light.pdf_solid_angle, emission_lights_->pmf(emitter), emission,
                                        light.n, light.wi, sqr(light.distance));
      others = mis_.others_of_light_sample(end.sums, pdfs, mis_cosine(end.hit.ng, light.wi), f.pdf_solid_angle,
                                           end.bsdf.reverse_pdf(end.wo, wi));
    } else if (!light.is_delta) {
      others = mis_.raised(f.pdf_solid_angle / (static_cast<double>(pmf) * light.pdf_solid_angle));
    }
    const Spectrum value = end.path.throughput * f.value * light.radiance * (1 / (pmf * light.pdf_solid_angle));
    connect(value, 1 / (1 + others), shadow_ray(end.hit, light), 1, end, state);
  }

  /// s >= 2.
  void join(const LightVertex& light, const CameraVertex& end, State& state) const {
    const int n_edges = static_cast<int>(light.n_vertices) + end.t - 1;
    if (n_edges > lengths_.max_depth || n_edges < lengths_.min_depth) return;
    const Vec3 between = light.p - end.hit.p;
    const float distance_squared = length_squared(between);
    if (!(distance_squared > 0)) return;
    const Vec3 w = between * (1 / std::sqrt(distance_squared));
    const Vec3 wi_camera = end.hit.frame.to_local(w), wi_light = light.frame.to_local(-w);
    const BsdfValue camera_f = end.bsdf.eval(end.wo, wi_camera);
    if (is_black(camera_f.value)) return;
    const BsdfValue light_f = light.bsdf->eval(light.wo, wi_light);
    if (is_black(light_f.value)) return;
    double others = mis_.others(light.sums, camera_f.pdf_solid_angle * mis_cosine(light.ng, w) / distance_squared,
                                light.bsdf->reverse_pdf(light.wo, wi_light));
    if (end.sums.any())
      others += mis_.others(end.sums, light_f.pdf_solid_angle * mis_cosine(end.hit.ng, w) / distance_squared,
                            end.bsdf.reverse_pdf(end.wo, wi_camera));
    const float factor = parts_.adjoint_factor(light.wo, wi_light, light.ng_local) / distance_squared;
    const Spectrum value = end.path.throughput * camera_f.value * (light.throughput * light_f.value * factor);
    const Vec3 target = offset_target(light.p, light.ng, light.offset, w, std::sqrt(distance_squared));
    connect(value, 1 / (1 + others), ray_between(offset_origin(end.hit, w), target), static_cast<int>(light.n_vertices),
            end, state);
  }

  static void connect(const Spectrum& value, double weight, const Ray& ray, int s, const CameraVertex& end,
                      State& state) {
    state.connections.push_back({value, static_cast<float>(weight), end.path.sample, s, end.t});
    state.rays.push_back(ray);
  }

  /// Adds the unoccluded connections.
  void trace_connections(const Scene& scene, std::span<CameraSample> samples, State& state,
                         PathContext& context) const {
    state.blocked.resize(state.rays.size());
    scene.occluded(state.rays, state.blocked);
    context.n_rays += state.rays.size();
    for (size_t i = 0; i < state.rays.size(); ++i) {
      if (state.blocked[i]) continue;
      const State::Connection& c = state.connections[i];
      parts_.record(c.s, c.t, c.value, c.weight);
      samples[c.sample].radiance += c.value * c.weight;
    }
    state.connections.clear(), state.rays.clear();
  }

  /// t = 1: splats a vertex of a light subpath.
  void join_to_lens(const Scene& scene, const LightPaths& paths, uint64_t path, const LightVertex& end,
                    std::vector<LightSplat>& splats, PathContext& context) const {
    const int n_edges = static_cast<int>(end.n_vertices);
    if (n_edges < lengths_.min_depth || (end.on_light && lengths_.hide_emitters)) return;
    const PathRandom random = paths.random(path);
    const LensSample lens = scene.camera().sample_towards(end.p, random.get_2d(end.address, Event::kLens));
    if (!(lens.pdf_solid_angle > 0)) return;
    const SplatPixel pixel = paths.pixel_at(lens.film, random.get_2d(end.address, Event::kPixel));
    if (!(pixel.weight > 0)) return;
    const Vec3 wi = end.frame.to_local(lens.wi);
    const BsdfValue f = end.bsdf->eval(end.wo, wi);
    if (is_black(f.value)) return;
    const double cosine = mis_cosine(end.ng, lens.wi), distance_squared = sqr(static_cast<double>(lens.distance));
    const double others =
        mis_.others(end.sums, lens.pdf_direction * cosine / (distance_squared * light_paths_per_spp()),
                    end.bsdf->reverse_pdf(end.wo, wi));
    if (!reaches_lens(scene, end, lens, context)) return;
    const float factor = parts_.adjoint_factor(end.wo, wi, end.ng_local) * lens.importance / lens.pdf_solid_angle;
    const Spectrum value = end.throughput * f.value * (factor * pixel.weight * parts_.splat_factor());
    const double weight = 1 / (1 + others);
    parts_.record_splat(n_edges, pixel, value, weight);
    splats.push_back({path, pixel.x, pixel.y, value * static_cast<float>(weight)});
  }

  /// Whether the camera sees the vertex, passing through area lights if these are hidden.
  bool reaches_lens(const Scene& scene, const LightVertex& end, const LensSample& lens, PathContext& context) const {
    const Vec3 o = offset_origin(end.p, end.ng, end.offset, lens.wi);
    const float distance = length(lens.near_p - o);
    Ray ray{o, (lens.near_p - o) * (1 / distance), distance};
    ++context.n_rays;
    if (!lengths_.hide_emitters) return !scene.occluded(ray);
    SurfaceHit hit;
    while (scene.intersect(ray, hit)) {
      if (!hit.emitter) return false;
      ray.o = offset_origin(hit, ray.d);
      ray.t_max -= hit.t;
      ++context.n_rays;
    }
    return true;
  }

  BidirectionalSettings settings_;
  PathLengthSettings lengths_;
  BidirectionalMis mis_;
  Parts parts_;
  std::optional<PowerLights> emission_lights_;
  Transform to_camera_;
};

}  // namespace covary
