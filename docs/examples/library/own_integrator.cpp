// SPDX-License-Identifier: Apache-2.0
// A custom integrator with an option: the maximum number of reflections.
//
//     own_integrator SCENE.xml [max-reflections=N]
#include <covary/combine/registry.h>
#include <covary/plans/estimator_plans.h>
#include <covary/plans/render.h>
#include <covary/scene/property_source.h>

#include <cstdio>
#include <cstring>
#include <exception>

using namespace covary;

struct Reflections final : Integrator {
  int most = 1;

  std::shared_ptr<Integrator> clone() const override { return std::make_shared<Reflections>(*this); }
  std::string description() const override { return "reflections most=" + std::to_string(most); }
  void trace(const Scene& scene, std::span<CameraSample> samples, PathContext& context) const override {
    for (CameraSample& sample : samples) {
      Spectrum throughput(1);
      Ray ray = sample.ray;
      SurfaceHit hit;
      for (uint32_t vertex = 1; ++context.n_rays, scene.intersect(ray, hit); ++vertex) {
        if (hit.emitter) sample.radiance += throughput * hit.emitter->surface_radiance(hit, -ray.d);
        const Vec3 wo = hit.frame.to_local(-ray.d);
        context.arena.reset();  // its memory is for the closures of one vertex
        const BsdfClosure* bsdf = hit.bsdf->bind(hit, wo.z > 0, TransportMode::kRadiance, context.arena);
        const BsdfSample next = bsdf->sample(wo, sample.random.get_1d(vertex, Event::kLobe),
                                             sample.random.get_2d(vertex, Event::kDirection));
        if (vertex > static_cast<uint32_t>(most) || !next.valid()) break;
        throughput *= next.weight;
        const Vec3 wi = hit.frame.to_world(next.wi);
        ray = {offset_origin(hit, wi), wi};
      }
    }
  }
};

int main(int argc, char** argv) try {
  constexpr const char* kOption = "max-reflections=";
  if (argc < 2 || argc > 3 || (argc == 3 && std::strncmp(argv[2], kOption, std::strlen(kOption)) != 0))
    return std::fprintf(stderr, "expected: own_integrator SCENE.xml [max-reflections=N]\n"), 2;
  OptionValues given;
  if (argc == 3) given["max-reflections"] = argv[2] + std::strlen(kOption);
  LoadOptions load;
  load.make_integrator = [&](Parameters& parameters) {
    if (parameters.type() != "reflections") parameters.ignore_rest();  // of the integrator that this one replaces
    PropertySource source(parameters, given);  // the scene file's parameters, overridden by `given`
    Settings settings(source);
    const auto integrator = std::make_shared<Reflections>();
    settings.whole("max-reflections", integrator->most, {.low = 0, .high = 1000}, "Most reflections");
    return integrator;
  };
  const LoadedScene scene = load_scene(argv[1], load);
  const RenderResult result = render(scene, estimator_plan(make_estimator(kNoEstimator)), {});
  const Image image = result.picture();
  double sum = 0;
  for (const float value : image.data) sum += value;
  std::printf("mean %.6f\n", sum / static_cast<double>(image.data.size()));
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "own_integrator: %s\n", error.what());
  return 1;
}
