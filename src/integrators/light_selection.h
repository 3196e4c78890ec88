// SPDX-License-Identifier: Apache-2.0
// Which light to sample: uniformly among all emitters, as [Hua2023] and Mitsuba do.
#pragma once

#include "scene/scene.h"

namespace covary {

/// Probability of each light.
inline float light_pmf(const Scene& scene) { return 1 / static_cast<float>(scene.emitters().size()); }

/// The light that `u` chooses; the scene must have one.
inline const Emitter& select_light(const Scene& scene, float u) {
  const size_t n = scene.emitters().size();
  return *scene.emitters()[std::min(static_cast<size_t>(u * static_cast<float>(n)), n - 1)];
}

/// Ray from a surface to a light sample, short of the light itself.
inline Ray shadow_ray(const SurfaceHit& hit, const EmitterSample& light) {
  const Vec3 o = offset_origin(hit.p, hit.ng, light.wi);
  if (light.distance == kInfinity) return {o, light.wi, kInfinity};
  const Vec3 d = hit.p + light.wi * light.distance - o;
  const float distance = length(d);
  return {o, d * (1 / distance), distance * (1 - 10 * kRayEpsilon)};
}

}  // namespace covary
