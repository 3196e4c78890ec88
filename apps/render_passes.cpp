// SPDX-License-Identifier: Apache-2.0
#include "render_passes.h"

#include <algorithm>
#include <chrono>

namespace covary {
namespace {

void add(const PassResult& from, PassResult& to) {
  to.n_samples += from.n_samples;
  to.n_rays += from.n_rays;
  to.n_not_finite += from.n_not_finite;
  to.n_negative += from.n_negative;
  to.seconds += from.seconds;
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

uint32_t smallest_count(const Film& film) { return *std::min_element(film.counts().begin(), film.counts().end()); }

void render_passes(const Scene& scene, const Integrator& integrator, std::vector<Pass>& passes,
                   const RenderLimits& limits) {
  const auto start = std::chrono::steady_clock::now();
  uint64_t total = 0;
  for (const Pass& pass : passes) total += samples_left(pass);
  uint64_t done = 0;
  const auto stopped = [&] { return limits.stop && limits.stop->load(); };
  for (;;) {
    Pass& pass = *std::min_element(passes.begin(), passes.end(),
                                   [](const Pass& a, const Pass& b) { return fraction(a) < fraction(b); });
    if (pass.count >= pass.settings.spp || stopped()) return;
    PassSettings wave = pass.settings;
    const uint32_t size = wave_size(pass.film.groups());
    wave.spp = std::min(pass.settings.spp, (pass.count / size + 1) * size);
    wave.stop = limits.stop;
    wave.checkpoint = nullptr;
    wave.progress = [&](uint64_t now, uint64_t) {
      if (limits.progress) limits.progress(done + now, total);
    };
    if (limits.seconds > 0 && (pass.count > 0 || passes.size() == 1)) {
      wave.seconds = limits.seconds - std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
      if (wave.seconds <= 0) return;
    }
    const PassResult result = render_pass(scene, integrator, wave, pass.film);
    add(result, pass.result);
    done += result.n_samples;
    if (!result.complete) return;  // interrupted, or out of time
    pass.count = wave.spp;
    pass.result.complete = pass.count >= pass.settings.spp;
    if (limits.checkpoint) limits.checkpoint();
  }
}

}  // namespace covary
