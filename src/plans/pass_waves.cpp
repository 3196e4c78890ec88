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
double fraction(const Pass& pass) { return static_cast<double>(pass.count) / pass.settings.spp.largest(); }

}  // namespace

uint64_t render_passes(const Scene& scene, std::span<Pass> passes, const WaveLimits& limits) {
  uint64_t total = 0;
  for (const Pass& pass : passes) total += pass.settings.spp.missing(pass.film);
  uint64_t done = 0;
  const auto stopped = [&] { return limits.stop && limits.stop->load(); };
  for (;;) {
    Pass& pass = *std::min_element(passes.begin(), passes.end(),
                                   [](const Pass& a, const Pass& b) { return fraction(a) < fraction(b); });
    if (pass.count >= pass.settings.spp.largest() || stopped()) return done;
    PassSettings wave = pass.settings;
    if (!wave.estimate) wave.limit = wave_end(pass.count, pass.film.groups());
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
    pass.count = pass.settings.spp.reached(pass.film);
    pass.result.complete = pass.count >= pass.settings.spp.largest();
    if (limits.wave) limits.wave();
  }
}

}  // namespace covary
