// SPDX-License-Identifier: Apache-2.0
#include "passes/light_pass.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/error.h"
#include "core/parallel.h"
#include "film/splat_layer.h"
#include "passes/pass_limits.h"

namespace covary {
namespace {

/// Per-thread state.
struct Worker {
  explicit Worker(const Integrator& integrator) : context(integrator) {}
  PathContext context;
  std::vector<LightSplat> splats;
};

LightPaths light_paths_of(const PassSettings& settings, const CropWindow& window, uint64_t first, uint32_t count) {
  return {settings.seed, settings.pass, first, count, SplatFilter(settings.filter), window};
}

/// Traces the paths and sorts their splats by path.
void trace_sorted(const Scene& scene, const LightTracingIntegrator& integrator, const LightPaths& paths,
                  std::vector<LightSplat>& splats, PathContext& context) {
  splats.clear();
  integrator.trace_light_paths(scene, paths, splats, context);
  std::stable_sort(splats.begin(), splats.end(),
                   [](const LightSplat& a, const LightSplat& b) { return a.path < b.path; });
}

}  // namespace

SplatPixel LightPaths::pixel_at(Vec2 film, Vec2 u) const {
  SplatPixel pixel = filter.pixel(film, u);
  const bool inside = pixel.x >= window.x && pixel.y >= window.y && pixel.x < window.x + window.width &&
                      pixel.y < window.y + window.height;
  return inside ? pixel : SplatPixel{};
}

void LightTracingIntegrator::fix_light_tracing(uint64_t n_pixels, bool beside_crn) {
  paths_per_spp_ = wants_light_pass(beside_crn) ? settings_.paths_per_sample * static_cast<double>(n_pixels) : 0;
}

std::string LightTracingIntegrator::light_tracing_text() const {
  return traces_light() ? fmt::format("light_tracing=on light_paths_per_spp={}", paths_per_spp_) : "light_tracing=off";
}

const LightTracingIntegrator* light_tracer(const Integrator& integrator) {
  const LightTracingIntegrator* tracer = integrator.light_tracing();
  return tracer && tracer->traces_light() ? tracer : nullptr;
}

uint32_t light_round_end(uint32_t count, int groups) {
  const uint32_t size = static_cast<uint32_t>(groups) * std::max(1u, SplatLayer::kRoundBundles / groups);
  uint64_t end = static_cast<uint64_t>(groups);
  while (end <= count && end < size) end *= 4;
  if (end > size) end = size;
  if (end <= count) end = (uint64_t{count} / size + 1) * size;
  return static_cast<uint32_t>(std::min<uint64_t>(end, UINT32_MAX / groups * groups));
}

PassResult render_light_pass(const Scene& scene, const LightTracingIntegrator& integrator, const PassSettings& settings,
                             Film& film) {
  COVARY_CHECK(settings.pass >= kLightPass, "a light pass has random numbers of its own");
  COVARY_CHECK(integrator.traces_light(), "the integrator traces no light here");
  const uint32_t target = std::min(settings.spp.largest(), settings.limit);
  SplatLayer layer(film, scene.has_film_response() || settings.filter.kind == FilterKind::kLobed);
  const uint32_t begin = film.count(0, 0);
  PassLimits limits(settings, uint64_t{target - std::min(begin, target)} * kBundlePaths);
  PerThread<Worker> workers;
  while (!limits.ended() && layer.begin_round(std::min(target, light_round_end(film.count(0, 0), film.groups())))) {
    const uint32_t first = layer.first_bundle();
    parallel_for(layer.end_bundle() - first, [&](uint32_t i) {
      if (limits.ended()) return;
      Worker& worker = workers.local(integrator);
      worker.context.stop = settings.stop;
      const uint64_t first_path = uint64_t{first + i} * kBundlePaths;
      trace_sorted(scene, integrator, light_paths_of(settings, film.crop(), first_path, kBundlePaths), worker.splats,
                   worker.context);
      if (worker.context.stopped()) return;
      for (const LightSplat& splat : worker.splats) layer.add(splat.path, splat.x, splat.y, scene.on_film(splat.value));
      limits.advance(kBundlePaths);
    });
    if (limits.ended()) break;
    layer.finish_round();
    if (settings.checkpoint) settings.checkpoint();
  }
  PassResult result;
  result.n_samples = uint64_t{film.count(0, 0) - begin} * kBundlePaths;
  workers.for_each([&](const Worker& worker) { result.n_rays += worker.context.n_rays; });
  const SplatCounts& counts = layer.counts();
  result.n_not_finite = counts.n_not_finite, result.n_negative = counts.n_negative;
  for (const BadSplat& bad : counts.bad_splats) result.bad_samples.push_back({bad.x, bad.y, bad.path, bad.value});
  result.complete = film.count(0, 0) >= target;
  result.seconds = limits.seconds();
  return result;
}

ReplayedLightPath replay_light_path(const Scene& scene, const LightTracingIntegrator& integrator,
                                    const PassSettings& settings, const CropWindow& window, uint64_t path) {
  PathContext context(integrator);
  ReplayedLightPath replayed;
  integrator.trace_light_paths(scene, light_paths_of(settings, window, path, 1), replayed.splats, context);
  for (LightSplat& splat : replayed.splats) splat.value = scene.on_film(splat.value);
  replayed.n_rays = context.n_rays;
  return replayed;
}

}  // namespace covary
