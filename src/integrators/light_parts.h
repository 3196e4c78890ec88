// SPDX-License-Identifier: Apache-2.0
// The light groups that parts of the radiance come from: Integrator::by_light().
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <unordered_map>

#include "passes/integrator.h"

namespace covary {

class LightParts {
 public:
  explicit LightParts(std::span<const std::string> groups) {
    for (const std::string& group : groups) places_.emplace(group, places_.size());
  }
  /// Call before the first contribution of a batch.
  void begin(size_t n_samples, PathContext& context) const {
    context.by_part.n_parts = places_.size() + 1;
    context.by_part.radiance.assign(n_samples * context.by_part.n_parts, Spectrum());
  }
  /// Adds a light's contribution to the radiance of a sample of the batch.
  void add(const Emitter& light, uint32_t sample, const Spectrum& radiance, PathContext& context) const {
    const auto found = places_.find(light.group());
    add_at(found == places_.end() ? places_.size() : found->second, sample, radiance, context);
  }
  /// Adds light of no group.
  void add_ungrouped(uint32_t sample, const Spectrum& radiance, PathContext& context) const {
    add_at(places_.size(), sample, radiance, context);
  }

 private:
  static void add_at(size_t place, uint32_t sample, const Spectrum& radiance, PathContext& context) {
    context.by_part.radiance[sample * context.by_part.n_parts + place] += radiance;
  }

  std::unordered_map<std::string, size_t> places_;
};

}  // namespace covary
