// SPDX-License-Identifier: Apache-2.0
// What one sample is made of, step by step on one thread: random numbers, camera rays, nearest hits, shadow rays, and
// whole paths, on the scenes of scenes/. items_per_second of "paths" are samples per second and thread.
#include <benchmark/benchmark.h>

#include <map>
#include <string>
#include <vector>

#include "integrators/integrator.h"
#include "integrators/light_selection.h"
#include "integrators/render_pass.h"
#include "io/load_scene.h"

namespace covary {
namespace {

constexpr uint64_t kSeed = 1;
constexpr int kItems = 4096;  // per iteration, spread over the frame

LoadedScene load(const std::string& name) {
  LoadOptions options;
  options.make_integrator = [](Parameters& parameters) -> std::shared_ptr<SceneObject> {
    return integrator_plugins()[0].make(parameters, PathLengthSettings::from(parameters));
  };
  return load_scene(std::string(COVARY_SOURCE_DIR) + "/scenes/" + name + ".xml", options);
}

const LoadedScene& scene(const std::string& name) {
  static std::map<std::string, LoadedScene> scenes;
  if (!scenes.contains(name)) scenes.emplace(name, load(name));
  return scenes.at(name);
}

/// The i-th of kItems paths: pixels in a fixed pseudo-random order over the whole frame, sample `sample`.
PathRandom path_random(const LoadedScene& loaded, int i, uint64_t sample) {
  const uint64_t pixel = mix64(i) % (static_cast<uint64_t>(loaded.width) * loaded.height);
  return {Sampling::kIndependent, kSeed, 0, pixel, sample};
}

Ray camera_ray(const LoadedScene& loaded, int i, const PathRandom& random) {
  const uint64_t pixel = mix64(i) % (static_cast<uint64_t>(loaded.width) * loaded.height);
  const int x = static_cast<int>(pixel % loaded.width), y = static_cast<int>(pixel / loaded.width);
  return loaded.scene->camera().ray(film_position(loaded.filter, x, y, random), random.get_2d(0, Event::kLens));
}

void random_numbers(benchmark::State& state) {
  const PathRandom random(Sampling::kIndependent, kSeed, 0, 17, 3);
  uint32_t vertex = 0;
  for (auto _ : state) benchmark::DoNotOptimize(random.get_2d(++vertex, Event::kDirection));
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(random_numbers);

void camera_rays(benchmark::State& state, const std::string& name) {
  const LoadedScene& loaded = scene(name);
  for (auto _ : state)
    for (int i = 0; i < kItems; ++i) benchmark::DoNotOptimize(camera_ray(loaded, i, path_random(loaded, i, 0)));
  state.SetItemsProcessed(state.iterations() * kItems);
}

void nearest_hits(benchmark::State& state, const std::string& name) {
  const LoadedScene& loaded = scene(name);
  std::vector<Ray> rays;
  for (int i = 0; i < kItems; ++i) rays.push_back(camera_ray(loaded, i, path_random(loaded, i, 0)));
  std::vector<RayHit> hits(rays.size());
  for (auto _ : state) {
    loaded.scene->nearest(rays, hits, true);
    benchmark::DoNotOptimize(hits.data());
  }
  state.SetItemsProcessed(state.iterations() * kItems);
}

/// From the points the camera sees towards the lights.
void shadow_rays(benchmark::State& state, const std::string& name) {
  const LoadedScene& loaded = scene(name);
  std::vector<Ray> rays;
  for (int i = 0; i < kItems; ++i) {
    const PathRandom random = path_random(loaded, i, 0);
    SurfaceHit hit;
    if (!loaded.scene->intersect(camera_ray(loaded, i, random), hit)) continue;
    const Emitter& light = UniformLights(*loaded.scene).select(random.get_1d(1, Event::kLightChoice));
    rays.push_back(shadow_ray(hit, light.sample_towards(hit.p, random.get_2d(1, Event::kLightPosition),
                                                        random.get_1d(1, Event::kLightPrimitive))));
  }
  std::vector<uint8_t> blocked(rays.size());
  for (auto _ : state) {
    loaded.scene->occluded(rays, blocked);
    benchmark::DoNotOptimize(blocked.data());
  }
  state.SetItemsProcessed(state.iterations() * static_cast<int64_t>(rays.size()));
}

void paths(benchmark::State& state, const std::string& name) {
  const LoadedScene& loaded = scene(name);
  const auto& integrator = dynamic_cast<const Integrator&>(*loaded.integrator);
  PathContext context(integrator);
  uint64_t sample = 0;
  std::vector<CameraSample> batch;
  for (auto _ : state) {
    batch.clear();
    for (int i = 0; i < kItems; ++i) {
      const PathRandom random = path_random(loaded, i, sample);
      batch.push_back({camera_ray(loaded, i, random), random, Spectrum(0)});
    }
    integrator.trace(*loaded.scene, batch, context);
    benchmark::DoNotOptimize(batch.data());
    ++sample;
  }
  state.SetItemsProcessed(state.iterations() * kItems);
  state.counters["rays"] = benchmark::Counter(static_cast<double>(context.n_rays), benchmark::Counter::kIsRate);
}

BENCHMARK_CAPTURE(camera_rays, room, "room");
BENCHMARK_CAPTURE(camera_rays, materials, "materials");
BENCHMARK_CAPTURE(nearest_hits, room, "room");
BENCHMARK_CAPTURE(nearest_hits, materials, "materials");
BENCHMARK_CAPTURE(shadow_rays, room, "room");
BENCHMARK_CAPTURE(shadow_rays, materials, "materials");
BENCHMARK_CAPTURE(paths, room, "room");
BENCHMARK_CAPTURE(paths, materials, "materials");

}  // namespace
}  // namespace covary
