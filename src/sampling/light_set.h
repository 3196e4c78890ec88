// SPDX-License-Identifier: Apache-2.0
// The lights of a scene, one by one. Emissive triangles, parallelograms, analytic shapes, and point and directional
// lights each have an index, which can be found from a sample or a hit, and a density of their own. The environment is
// not included: users sample it separately.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/distribution.h"
#include "core/large_vector.h"
#include "sampling/light_clusters.h"
#include "sampling/system_sums.h"
#include "scene/scene.h"

namespace covary {

/// Probabilities of lights.
enum class LightSelection {
  kTriangle,  ///< uniform over emissive triangles [Hua2023] §6; analytic shapes and delta lights count as one each
  kShape,     ///< uniform over shapes and delta lights, then by area, as in `path`
  kPower,     ///< proportional to power (mean over channels), by light_selection.h
  kLearned,   ///< initially as kPower; integrators that learn update it by LightSet::change()
};

/// "triangle", "shape", "power", "learned".
std::string name_of(LightSelection selection);

/// One light: an emitter or a part of one, such as a triangle.
struct Light {
  const Emitter* emitter;
  uint32_t part;
  float pmf;  ///< selection probability, a multiple of 2^-24
};

/// Made for one scene, which must outlive it; reading is thread-safe.
class LightSet {
 public:
  LightSet() = default;
  /// Throws Error(kInput) if there are more than 2^22 lights.
  LightSet(const Scene& scene, LightSelection selection);

  /// Sets the probabilities to multiples of 2^-24 close to the normalised `weights`: finite, non-negative, one per
  /// light, not all zero. A positive weight gives a positive probability.
  void change(const std::vector<double>& weights);

  uint32_t size() const { return static_cast<uint32_t>(lights_.size()); }
  bool empty() const { return lights_.empty(); }
  const Light& operator[](uint32_t number) const { return lights_[number]; }

  /// Index of the light chosen by `u` in [0, 1); there must be at least one. Lights of probability 0 are never chosen.
  uint32_t select(float u) const { return selection_.sample(u).index; }
  /// Samples one light as seen from `reference`; the density is for this light alone, without Light::pmf.
  EmitterSample sample(uint32_t number, const Vec3& reference, Vec2 u, float u_primitive) const {
    const Light& light = lights_[number];
    return light.emitter->sample_part_towards(light.part, reference, u, u_primitive);
  }
  /// Index of the light that a hit on an emitter belongs to.
  uint32_t number_of(const SurfaceHit& hit) const {
    return first_[emitters_.find(key_of(*hit.emitter))] + hit.emitter->part_of(hit);
  }
  /// Prefetches what sample() reads first.
  void prefetch(uint32_t number) const { __builtin_prefetch(&lights_[number]); }
  /// Density of sample() for that light, per unit solid angle at `reference`.
  static float pdf_solid_angle(const Vec3& reference, const SurfaceHit& hit) {
    return hit.emitter->pdf_part_solid_angle(reference, hit);
  }

 private:
  static uint64_t key_of(const Emitter& emitter) { return reinterpret_cast<uintptr_t>(&emitter); }

  LargeVector<Light> lights_;    // the parts of an emitter are contiguous
  KeyIndex emitters_;            // by address
  std::vector<uint32_t> first_;  // index of the first part of each of emitters_
  Discrete selection_;
};

/// Clusters of the lights of a set, at most `limit` (at least 1); see cluster_lights(). `scene`: bounds of the scene.
LightClusters cluster_light_set(const LightSet& lights, const Bounds3& scene, uint32_t limit);

/// Expected number of samples of each cluster when a vertex takes one sample of the whole set.
std::vector<float> expected_samples(const LightClusters& clusters, const LightSet& lights);

}  // namespace covary
