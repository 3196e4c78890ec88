// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "scene/emitter.h"

namespace covary {

/// Samples an environment for many vertices together, which hides the latency of its tables and texels.
class EnvironmentQueue {
 public:
  explicit EnvironmentQueue(const Emitter& environment) : environment_(environment) {}

  /// Adds a sample made from `u`; set(index, EmitterSample) is called with it at the latest by finish().
  template <typename Set>
  void add(uint32_t index, Vec2 u, const Set& set) {
    const int i = samples_.size++;
    index_[i] = index, samples_.u_x[i] = u.x, samples_.u_y[i] = u.y;
    if (samples_.size == EnvironmentSamples::kCapacity) finish(set);
  }
  template <typename Set>
  void finish(const Set& set) {
    const bool together = environment_.sample_environment(samples_);
    for (int i = 0; i < samples_.size; ++i) {
      if (!together) {
        set(index_[i], environment_.sample_towards({}, {samples_.u_x[i], samples_.u_y[i]}, 0));
        continue;
      }
      EmitterSample sample;
      sample.wi = {samples_.wi_x[i], samples_.wi_y[i], samples_.wi_z[i]};
      sample.radiance = {samples_.r[i], samples_.g[i], samples_.b[i]};
      sample.pdf_solid_angle = samples_.pdf_solid_angle[i];
      set(index_[i], sample);
    }
    samples_.size = 0;
  }

 private:
  const Emitter& environment_;
  EnvironmentSamples samples_;
  uint32_t index_[EnvironmentSamples::kCapacity];
};

}  // namespace covary
