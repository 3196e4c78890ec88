// SPDX-License-Identifier: Apache-2.0
// The passes of a phase, wave by wave.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>

#include "plans/plan.h"

namespace covary {

struct WaveLimits {
  const std::atomic<bool>* stop = nullptr;  ///< stop at the next tile
  /// If given, called before each wave once every pixel has samples of every pass: returns the seconds left.
  std::function<double()> seconds_left;
  std::function<void(uint64_t done, uint64_t total)> progress;  ///< samples and light paths of all passes together
  std::function<void()> wave;                                   ///< called between waves
  bool small_waves = false;                                     ///< RenderCallbacks::small_waves
  std::function<std::optional<CropWindow>()> region;            ///< RenderCallbacks::region
};

/// Renders all passes up to their settings.spp, wave by wave; the pass that is furthest behind is next, so that passes
/// advance together. Returns the samples and light paths taken.
uint64_t render_passes(const Scene& scene, std::span<Pass> passes, const WaveLimits& limits);

}  // namespace covary
