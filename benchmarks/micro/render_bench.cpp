// SPDX-License-Identifier: Apache-2.0
// What one sample is made of, step by step on one thread: random numbers, camera rays, nearest hits, shadow rays, and
// whole paths, on the scenes of scenes/, and in a room with 10² to 10⁵ emissive triangles. items_per_second of "paths"
// and "many_lights" are samples per second and thread.
#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <vector>

#include "integrators/controlled_path.h"
#include "integrators/registry.h"
#include "io/load_scene.h"
#include "passes/integrator.h"
#include "passes/render_pass.h"
#include "sampling/light_selection.h"
#include "scene/property_source.h"

namespace covary {
namespace {

constexpr uint64_t kSeed = 1;
constexpr int kItems = 4096;  // per iteration, spread over the frame

LoadedScene load(const std::string& path, const std::string& integrator, const OptionValues& values = {}) {
  LoadOptions options;
  options.make_integrator = [&](Parameters& parameters) -> std::shared_ptr<SceneObject> {
    PropertySource source(parameters, values);
    Settings settings(source);
    return make_integrator(*find_integrator(integrator), settings);
  };
  return load_scene(path, options);
}

const LoadedScene& scene(const std::string& name) {
  static std::map<std::string, LoadedScene> scenes;
  if (!scenes.contains(name))
    scenes.emplace(name, load(std::string(COVARY_SOURCE_DIR) + "/scenes/" + name + ".xml", "path"));
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

void trace_paths(benchmark::State& state, const LoadedScene& loaded) {
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

void paths(benchmark::State& state, const std::string& name) { trace_paths(state, scene(name)); }

/// Writes a room under a grid of about `n` emissive triangles into `folder`, and returns its scene file.
std::string write_room_of_lights(const std::filesystem::path& folder, int64_t n) {
  const auto side = static_cast<int>(std::lround(std::sqrt(static_cast<double>(n) / 2)));
  std::ofstream mesh(folder / "lights.obj");
  for (int y = 0; y <= side; ++y)
    for (int x = 0; x <= side; ++x) mesh << fmt::format("v {} 3 {}\n", 8.0 * x / side - 4, 8.0 * y / side - 4);
  for (int y = 0; y < side; ++y)
    for (int x = 0; x < side; ++x) {
      const int a = y * (side + 1) + x + 1, b = a + side + 1;
      mesh << fmt::format("f {} {} {}\nf {} {} {}\n", a, a + 1, b, a + 1, b + 1, b);
    }
  const std::filesystem::path scene = folder / "room.xml";
  std::ofstream(scene) << R"(<scene version="3.0.0">
  <integrator type="path"><integer name="max_depth" value="4"/></integrator>
  <sensor type="perspective"><float name="fov" value="60"/>
    <transform name="to_world"><lookat origin="0, 1, -7" target="0, 1, 0" up="0, 1, 0"/></transform>
    <film type="hdrfilm"><integer name="width" value="64"/><integer name="height" value="48"/></film></sensor>
  <shape type="cube"><transform name="to_world"><scale value="8, 4, 8"/></transform>
    <bsdf type="twosided"><bsdf type="diffuse"/></bsdf></shape>
  <shape type="obj"><string name="filename" value="lights.obj"/>
    <emitter type="area"><rgb name="radiance" value="1, 2, 3"/></emitter></shape>
</scene>)";
  return scene.string();
}

void many_lights(benchmark::State& state, const std::string& integrator, const OptionValues& values) {
  const std::filesystem::path folder = std::filesystem::temp_directory_path() / "covary-render-bench";
  std::filesystem::create_directories(folder);
  const LoadedScene loaded = load(write_room_of_lights(folder, state.range(0)), integrator, values);
  std::filesystem::remove_all(folder);
  if (auto* controlled = dynamic_cast<ControlledPath*>(loaded.integrator.get())) {
    controlled->prepare(*loaded.scene);
    train(*loaded.scene, *controlled, {{0, 0, loaded.width, loaded.height}, loaded.filter});
  }
  trace_paths(state, loaded);
}

BENCHMARK_CAPTURE(camera_rays, room, "room");
BENCHMARK_CAPTURE(camera_rays, materials, "materials");
BENCHMARK_CAPTURE(nearest_hits, room, "room");
BENCHMARK_CAPTURE(nearest_hits, materials, "materials");
BENCHMARK_CAPTURE(shadow_rays, room, "room");
BENCHMARK_CAPTURE(shadow_rays, materials, "materials");
BENCHMARK_CAPTURE(paths, room, "room");
BENCHMARK_CAPTURE(paths, materials, "materials");
BENCHMARK_CAPTURE(many_lights, path, "path", OptionValues())->RangeMultiplier(10)->Range(100, 100000);
BENCHMARK_CAPTURE(many_lights, off, "controlled-path", OptionValues({{"cv", "off"}}))
    ->RangeMultiplier(10)
    ->Range(100, 100000);
BENCHMARK_CAPTURE(many_lights, rgb, "controlled-path", OptionValues({{"cv", "rgb"}}))
    ->RangeMultiplier(10)
    ->Range(100, 100000);

}  // namespace
}  // namespace covary
