// SPDX-License-Identifier: Apache-2.0
// Light selection. A selection is made for one scene, which must outlive it; reading is thread-safe.
#pragma once

#include <algorithm>
#include <span>
#include <unordered_map>
#include <vector>

#include "core/distribution.h"
#include "scene/emitter.h"
#include "scene/scene.h"

namespace covary {

/// Uniform over all lights, as in [Hua2023] and Mitsuba. Free to construct.
class UniformLights {
 public:
  explicit UniformLights(const Scene& scene)
      : emitters_(scene.emitters()), pmf_(1 / static_cast<float>(emitters_.size())) {}
  bool empty() const { return emitters_.empty(); }
  /// The light chosen by `u` in [0, 1); there must be at least one.
  const Emitter& select(float u) const {
    const size_t n = emitters_.size();
    return *emitters_[std::min(static_cast<size_t>(u * static_cast<float>(n)), n - 1)];
  }
  /// Probability with which select() returns this light.
  float pmf(const Emitter&) const { return pmf_; }

 private:
  std::span<const std::shared_ptr<const Emitter>> emitters_;
  float pmf_;
};

/// Proportional to the luminance of Emitter::power(), by weights_by_power(). A light known to have no power is never
/// chosen; if none has any, or one's is infinite, all are equally likely.
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

/// Ray from `o` to a light sample, ending just short of the light.
inline Ray shadow_ray(const Vec3& o, const EmitterSample& light) {
  if (light.distance == kInfinity) return {o, light.wi, kInfinity};
  return ray_between(o, offset_target(light.p, light.n, light.offset, light.wi, light.distance));
}
/// The same from a surface.
inline Ray shadow_ray(const SurfaceHit& hit, const EmitterSample& light) {
  return shadow_ray(offset_origin(hit, light.wi), light);
}

// Weights for choosing lights in proportion to their power. A light may become unlikely, never impossible.

struct LightPower {
  double power;  ///< at least 0; arbitrary if unknown
  bool exact;    ///< false: estimated from a few points, Emitter::knows_power()
};

/// Proportional to power. A light whose power is an estimate weighs at least 1 % of the mean light, so that one whose
/// few bright points were missed is still found. All weights are equal if no power is positive or one is not finite.
std::vector<double> weights_by_power(std::span<const LightPower> lights);

}  // namespace covary
