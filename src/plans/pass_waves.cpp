// SPDX-License-Identifier: Apache-2.0
#include "plans/pass_waves.h"

#include <algorithm>

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
}

/// Part of the pass that is done.
double fraction(const Pass& pass) { return static_cast<double>(pass.count) / pass.settings.spp; }

uint64_t samples_left(const Pass& pass) {
  uint64_t left = 0;
  for (uint32_t count : pass.film.counts()) left += pass.settings.spp - std::min(count, pass.settings.spp);
  return left;
}

}  // namespace

uint64_t render_passes(const Scene& scene, std::span<Pass> passes, const WaveLimits& limits) {
  uint64_t total = 0;
  for (const Pass& pass : passes) total += samples_left(pass);
  uint64_t done = 0;
  const auto stopped = [&] { return limits.stop && limits.stop->load(); };
  for (;;) {
    Pass& pass = *std::min_element(passes.begin(), passes.end(),
                                   [](const Pass& a, const Pass& b) { return fraction(a) < fraction(b); });
    if (pass.count >= pass.settings.spp || stopped()) return done;
    PassSettings wave = pass.settings;
    wave.spp =
        wave.estimate ? pass.settings.spp : std::min(pass.settings.spp, wave_end(pass.count, pass.film.groups()));
    wave.stop = limits.stop;
    wave.checkpoint = wave.estimate ? limits.wave : nullptr;  // that wave is all there is
    wave.progress = [&](uint64_t now, uint64_t) {
      if (limits.progress) limits.progress(done + now, total);
    };
    if (limits.seconds_left && pass.count > 0) {  // the pass that is farthest behind
      wave.seconds = limits.seconds_left();
      if (wave.seconds <= 0) return done;
    }
    const PassResult result = render_pass(scene, *pass.integrator, wave, pass.film);
    add(result, pass.result);
    done += result.n_samples;
    if (!result.complete) return done;  // interrupted, or out of time
    pass.count = wave.spp;
    pass.result.complete = pass.count >= pass.settings.spp;
    if (limits.wave) limits.wave();
  }
}

}  // namespace covary
