// SPDX-License-Identifier: Apache-2.0
#include "plans/pass_waves.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "core/processor_time.h"
#include "film/splat_layer.h"
#include "passes/light_pass.h"
#include "passes/pass_limits.h"

namespace covary {
namespace {

void add(const PassResult& from, PassResult& to) {
  to.n_samples += from.n_samples;
  to.n_rays += from.n_rays;
  to.n_not_finite += from.n_not_finite;
  to.n_negative += from.n_negative;
  to.seconds += from.seconds;
  to.estimate_seconds += from.estimate_seconds;
  to.bad_samples.insert(to.bad_samples.end(), from.bad_samples.begin(), from.bad_samples.end());
  keep_first(to.bad_samples);
}

/// Completed fraction of the pass.
double fraction(const Pass& pass) {
  return pass.count / (pass.plan.light ? pass.wanted : static_cast<double>(pass.settings.spp.largest()));
}

bool is_complete(const Pass& pass) { return pass.count >= pass.settings.spp.largest(); }

/// Remaining work for the progress: camera samples and light paths.
uint64_t missing(const Pass& pass) {
  if (!pass.plan.light) return pass.settings.spp.missing(pass.film);
  const uint32_t target = pass.settings.spp.largest();
  return uint64_t{target - std::min(target, pass.count)} * kBundlePaths;
}

/// The pass that is furthest behind; null if all are complete.
Pass* next_pass(std::span<Pass> passes) {
  Pass* next = nullptr;
  for (Pass& pass : passes)
    if (!is_complete(pass) && (!next || fraction(pass) < fraction(*next))) next = &pass;
  return next;
}

/// Samples of a light film at the end of the next round: at most what the pass achieves in the given time, because a
/// round is only useful when complete.
uint32_t light_limit(const Pass& pass, std::optional<double> seconds) {
  const auto groups = static_cast<uint32_t>(pass.film.groups());
  const uint32_t end = light_round_end(pass.count, pass.film.groups());
  if (!seconds) return end;
  const double speed = static_cast<double>(pass.result.n_samples) / kBundlePaths / std::max(pass.result.seconds, 1e-9);
  const double n_groups = std::min<double>(*seconds * speed / groups, (end - pass.count) / groups);
  return pass.count + static_cast<uint32_t>(n_groups) * groups;
}

/// Samples at the end of the pass's next wave; a small one takes about a second, or a sample per pixel.
uint32_t camera_limit(const Pass& pass, bool small) {
  const uint32_t end = wave_end(pass.count, pass.film.groups());
  if (!small) return end;
  const auto pixels = static_cast<double>(pass.film.counts().size());
  const double per_second = static_cast<double>(pass.result.n_samples) / std::max(pass.result.seconds, 1e-9) / pixels;
  const double more = std::clamp(per_second, 1.0, std::max(1.0, static_cast<double>(pass.count)));
  return static_cast<uint32_t>(std::min<double>(end, pass.count + more));
}

/// The pass's own targets in `region`, and outside what the film has: the region's samples are taken first, and no
/// pixel gets others than without it.
SampleTarget target_in(const CropWindow& region, const Pass& pass) {
  const CropWindow& window = pass.film.crop();
  std::vector<uint32_t> map = pass.film.counts();
  for (int y = 0; y < window.height; ++y)
    for (int x = 0; x < window.width; ++x) {
      const int fx = window.x + x - region.x, fy = window.y + y - region.y;
      const size_t i = static_cast<size_t>(y) * window.width + x;
      if (fx >= 0 && fy >= 0 && fx < region.width && fy < region.height)
        map[i] = std::max(map[i], pass.settings.spp.at(i));
    }
  return SampleTarget(std::move(map));
}

/// If passes lack samples in the region: makes the next wave one of the pass that is furthest behind there, and in it.
void narrow_to_region(const WaveLimits& limits, std::span<Pass> passes, Pass*& next, PassSettings& wave) {
  const std::optional<CropWindow> region = limits.region ? limits.region() : std::nullopt;
  if (!region) return;
  Pass* behind = nullptr;
  uint32_t fewest = UINT32_MAX;
  for (Pass& pass : passes) {
    if (pass.plan.light || pass.settings.estimate) continue;
    SampleTarget target = target_in(*region, pass);
    if (target.missing(pass.film) == 0) continue;
    const uint32_t reached = target.reached(pass.film);
    if (behind && reached >= fewest) continue;
    behind = &pass, fewest = reached;
    wave = pass.settings;
    wave.spp = std::move(target);
  }
  if (!behind) return;
  next = behind;
  wave.limit = wave_end(fewest, behind->film.groups());
}

PassResult render_wave(const Scene& scene, const Pass& pass, const PassSettings& settings, Film& film) {
  if (!pass.plan.light) return render_pass(scene, *pass.integrator, settings, film);
  return render_light_pass(scene, *light_tracer(*pass.integrator), settings, film);
}

}  // namespace

uint64_t render_passes(const Scene& scene, std::span<Pass> passes, const WaveLimits& limits) {
  uint64_t total = 0;
  for (const Pass& pass : passes) total += missing(pass);
  uint64_t done = 0;
  const auto stopped = [&] { return limits.stop && limits.stop->load(); };
  for (;;) {
    Pass* next = next_pass(passes);
    if (!next || stopped()) return done;
    PassSettings wave = next->settings;
    if (!wave.estimate) wave.limit = camera_limit(*next, limits.small_waves);
    narrow_to_region(limits, passes, next, wave);
    Pass& pass = *next;
    if (pass.plan.light) wave.limit = light_limit(pass, {});
    wave.stop = limits.stop;
    wave.checkpoint = wave.estimate ? limits.wave : nullptr;  // this is the only wave
    wave.progress = [&](uint64_t now, uint64_t) {
      if (limits.progress) limits.progress(done + now, total);
    };
    if (limits.seconds_left && pass.count > 0) {  // the pass that is furthest behind
      wave.seconds = limits.seconds_left();
      if (wave.seconds <= 0) return done;
      if (pass.plan.light) {
        wave.limit = light_limit(pass, std::exchange(wave.seconds, 0));
        if (wave.limit == pass.count) return done;
      }
    }
    const double before = processor_seconds();
    const PassResult result = render_wave(scene, pass, wave, pass.film);
    pass.processor_seconds += processor_seconds() - before;
    add(result, pass.result);
    done += result.n_samples;
    if (!result.complete) return done;  // interrupted, or out of time
    pass.count = pass.settings.spp.reached(pass.film);
    pass.result.complete = is_complete(pass);
    if (limits.wave) limits.wave();
  }
}

}  // namespace covary
