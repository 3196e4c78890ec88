// SPDX-License-Identifier: Apache-2.0
// A small light tracer for tests of the code around light tracing. Weights do not depend on the path: camera samples
// are those of `path` times 1 - share; light paths are connected to the lens at each vertex and weighted by `share`. So
// the expected image is that of `path` if light paths find everything: a pinhole camera, no mirrors in view, area and
// point lights. Slow and simple, one path at a time.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "integrators/path_tracer.h"
#include "passes/light_pass.h"

namespace covary::test_support {

/// A diffuse corner with an area light, a point light and a sphere; the camera looks along +z.
inline std::string corner_text(int width, int height, const std::string& rfilter,
                               const std::string& type = "perspective", const std::string& sensor = "") {
  return "<scene version='3.0.0'><integrator type='path'/><sensor type='" + type + "'>" + sensor +
         "<film type='hdrfilm'><integer name='width' value='" + std::to_string(width) +
         "'/><integer name='height' value='" + std::to_string(height) + "'/><rfilter type='" + rfilter +
         "'/></film></sensor>"
         "<shape type='rectangle'><transform name='to_world'><scale value='4'/><rotate y='1' angle='180'/>"
         "<translate z='6'/></transform></shape>"
         "<shape type='rectangle'><transform name='to_world'><scale value='4'/><rotate x='1' angle='-90'/>"
         "<translate y='-1' z='4'/></transform></shape>"
         "<shape type='sphere'><point name='center' x='0.4' y='-0.4' z='4'/><float name='radius' value='0.6'/>"
         "<bsdf type='diffuse'><rgb name='reflectance' value='0.8, 0.4, 0.2'/></bsdf></shape>"
         "<shape type='rectangle'><transform name='to_world'><scale value='0.5'/><rotate x='1' angle='120'/>"
         "<translate x='-0.8' y='1' z='4.4'/></transform><emitter type='area'><rgb name='radiance' value='6, 5, 4'/>"
         "</emitter></shape>"
         "<emitter type='point'><point name='position' x='1.5' y='1' z='3'/><rgb name='intensity' value='1, 2, 4'/>"
         "</emitter></scene>";
}

class LightTracer final : public LightTracingIntegrator {
 public:
  /// lengths.max_depth should be small: light paths have no Russian roulette.
  LightTracer(const LightTracingSettings& settings, const PathLengthSettings& lengths, float share)
      : LightTracingIntegrator(settings), path_("path", lengths), longest_(lengths.max_depth), share_(share) {}

  std::shared_ptr<Integrator> clone() const override { return std::make_shared<LightTracer>(*this); }
  void prepare(const Scene& scene) override { path_.prepare(scene); }
  std::unique_ptr<ThreadState> make_thread_state() const override { return path_.make_thread_state(); }
  void trace(const Scene& scene, std::span<CameraSample> samples, PathContext& context) const override {
    path_.trace(scene, samples, context);
    if (traces_light())
      for (CameraSample& sample : samples) sample.radiance *= 1 - share_;
  }
  std::string description() const override {
    return "test light tracer on " + path_.description() + " " + light_tracing_text();
  }

  void trace_light_paths(const Scene& scene, const LightPaths& paths, std::vector<LightSplat>& splats,
                         PathContext& context) const override {
    for (uint64_t path = paths.first; path < paths.first + paths.count; ++path) {
      const PathRandom root = paths.random(path);
      const Join join{scene, paths, path, root, splats, context};
      trace_light_path(join, root.subpath(Subpath::kLight));
    }
  }

 private:
  struct Join {
    const Scene& scene;
    const LightPaths& paths;
    uint64_t path;
    const PathRandom& random;
    std::vector<LightSplat>& splats;
    PathContext& context;
  };

  void trace_light_path(const Join& join, const PathRandom& walk) const {
    const auto emitters = join.scene.emitters();
    const auto choice = static_cast<size_t>(walk.get_1d(0, Event::kLightChoice) * static_cast<float>(emitters.size()));
    const EmissionSample e =
        emitters[choice]->sample_emission(walk.get_2d(0, Event::kLightPosition), walk.get_2d(0, Event::kLightDirection),
                                          walk.get_1d(0, Event::kLightPrimitive));
    const float cosine = e.delta_position ? 1 : dot(e.n, e.ray.d);
    Spectrum throughput = e.radiance * (static_cast<float>(emitters.size()) / e.pdf_position);
    if (!e.delta_position)
      add(join, 0, 1, e.ray.o, e.n, e.offset, throughput, [&](const Vec3& wi) { return std::max(0.0f, dot(e.n, wi)); });
    throughput *= cosine / e.pdf_direction;
    Ray ray = e.ray;
    ray.o = offset_origin(ray.o, e.n, e.offset, ray.d);
    SurfaceHit hit;
    for (int edges = 1; edges + 1 <= longest_; ++edges) {
      ++join.context.n_rays;
      if (!join.scene.intersect(ray, hit)) return;
      join.context.arena.reset();
      const Vec3 wo = hit.frame.to_local(-ray.d), ng = hit.frame.to_local(hit.ng), ns{0, 0, 1};
      const BsdfClosure* bsdf = hit.bsdf->bind(hit, wo.z > 0, TransportMode::kImportance, join.context.arena);
      const auto vertex = static_cast<uint32_t>(edges);
      add(join, vertex, edges + 1, hit.p, hit.ng, hit.offset, throughput, [&](const Vec3& wi_world) {
        const Vec3 wi = hit.frame.to_local(wi_world);
        return bsdf->eval(wo, wi).value * shading_normal_factor(wo, wi, ns, ng, TransportMode::kImportance);
      });
      const BsdfSample next =
          bsdf->sample(wo, walk.get_1d(vertex, Event::kLobe), walk.get_2d(vertex, Event::kDirection));
      if (!next.valid()) return;
      throughput *= next.weight * shading_normal_factor(wo, next.wi, ns, ng, TransportMode::kImportance);
      const Vec3 wi = hit.frame.to_world(next.wi);
      ray = {offset_origin(hit, wi), wi, kInfinity};
    }
  }

  /// Connects a vertex to the lens; `f` is called with the direction to it.
  template <typename F>
  void add(const Join& join, uint32_t vertex, int edges, const Vec3& p, const Vec3& ng, float offset,
           const Spectrum& throughput, const F& f) const {
    if (edges > longest_) return;
    const LensSample lens = join.scene.camera().sample_towards(p, join.random.get_2d(vertex, Event::kLens));
    if (!(lens.pdf_solid_angle > 0 && lens.importance > 0)) return;
    const SplatPixel pixel = join.paths.pixel_at(lens.film, join.random.get_2d(vertex, Event::kPixel));
    if (pixel.weight == 0) return;
    const Spectrum value = throughput * f(lens.wi) * (share_ * pixel.weight * lens.importance / lens.pdf_solid_angle);
    if (is_black(value)) return;
    const Vec3 o = offset_origin(p, ng, offset, lens.wi);
    const Vec3 d = lens.near_p - o;
    const float distance = length(d);
    ++join.context.n_rays;
    if (!join.scene.occluded({o, d * (1 / distance), distance}))
      join.splats.push_back({join.path, pixel.x, pixel.y, value});
  }

  PathTracer<PathParts> path_;
  int longest_;
  float share_;
};

}  // namespace covary::test_support
