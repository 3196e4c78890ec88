// SPDX-License-Identifier: Apache-2.0
// The passes of a plan while they are rendered: films, where they are kept, and what they cost.
#pragma once

#include <atomic>
#include <functional>
#include <string>
#include <vector>

#include "film/film.h"
#include "integrators/render_pass.h"

namespace covary {

struct Pass {
  PassSettings settings;  ///< spp: samples per pixel to reach
  Film film;
  std::string path;    ///< the file that keeps the film
  uint32_t count = 0;  ///< samples that every pixel has
  PassResult result;   ///< of all calls together, earlier ones included where --passes keeps them

  std::string name() const { return settings.sampling == Sampling::kCrn ? "crn" : "independent"; }
};

/// The smallest number of samples a pixel of the film has.
uint32_t smallest_count(const Film& film);

struct RenderLimits {
  double seconds = 0;                       ///< > 0: stop after this time, once every pixel has samples of every pass
  const std::atomic<bool>* stop = nullptr;  ///< stop at the next tile
  std::function<void(uint64_t done, uint64_t total)> progress;  ///< samples of all passes together
  std::function<void()> checkpoint;                             ///< called between waves
};

/// Renders all passes up to their settings.spp. The pass with the smallest part of its samples is next, one wave at a time,
/// so that the passes advance together.
void render_passes(const Scene& scene, const Integrator& integrator, std::vector<Pass>& passes,
                   const RenderLimits& limits);

}  // namespace covary
