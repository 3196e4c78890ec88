// SPDX-License-Identifier: Apache-2.0
// Which light to sample. A selection is made for one scene, which must outlive it; it is read by many threads.
#pragma once

#include <algorithm>
#include <span>
#include <unordered_map>
#include <vector>

#include "core/distribution.h"
#include "scene/emitter.h"
#include "scene/scene.h"

namespace covary {

/// Uniformly among all lights, as [Hua2023] and Mitsuba do. Costs nothing to make.
class UniformLights {
 public:
  explicit UniformLights(const Scene& scene)
      : emitters_(scene.emitters()), pmf_(1 / static_cast<float>(emitters_.size())) {}
  bool empty() const { return emitters_.empty(); }
  /// The light that `u` in [0, 1) chooses; there must be one.
  const Emitter& select(float u) const {
    const size_t n = emitters_.size();
    return *emitters_[std::min(static_cast<size_t>(u * static_cast<float>(n)), n - 1)];
  }
  /// Probability that select() gives this light of the scene.
  float pmf(const Emitter&) const { return pmf_; }

 private:
  std::span<const std::shared_ptr<const Emitter>> emitters_;
  float pmf_;
};

/// In proportion to the luminance of Emitter::power(), by sampling/light_selection.h. A light that is known to have no
/// power is never chosen; where none has any, or one has infinitely much, all are equally likely.
class PowerLights {
 public:
  explicit PowerLights(const Scene& scene);
  bool empty() const { return emitters_.empty(); }
  const Emitter& select(float u) const { return *emitters_[distribution_.sample(u).index]; }
  float pmf(const Emitter& emitter) const { return pmfs_.at(&emitter); }

 private:
  std::span<const std::shared_ptr<const Emitter>> emitters_;
  Discrete distribution_;
  std::unordered_map<const Emitter*, float> pmfs_;
};

/// Ray from a surface to a light sample, short of the light itself.
inline Ray shadow_ray(const SurfaceHit& hit, const EmitterSample& light) {
  const Vec3 o = offset_origin(hit, light.wi);
  if (light.distance == kInfinity) return {o, light.wi, kInfinity};
  const Vec3 d = hit.p + light.wi * light.distance - o;
  const float distance = length(d);
  return {o, d * (1 / distance), distance * (1 - 10 * kRayEpsilon)};
}

// Weights by which lights are chosen in proportion to their powers. A light may become unlikely, never impossible.

struct LightPower {
  double power;  ///< at least 0; any number where none is known
  bool exact;    ///< false: an estimate from some points, Emitter::knows_power()
};

/// In proportion to the powers. A light whose power is an estimate weighs at least 1 % of the mean light, so that one
/// whose few bright points were missed is found. All weigh the same where no power is positive or one is not finite.
std::vector<double> weights_by_power(std::span<const LightPower> lights);

}  // namespace covary
