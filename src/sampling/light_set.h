// SPDX-License-Identifier: Apache-2.0
// The lights of a scene one by one. Emissive triangles, parallelograms, analytic shapes and lights at a point or in one
// direction each have a number, found from a sample and from a hit, and a density of their own. An environment is not
// among them: who samples it does so apart.
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

/// How probable each light is.
enum class LightSelection {
  kTriangle,  ///< uniform over emissive triangles [Hua2023] §6; analytic shapes and delta lights count as one each
  kShape,     ///< uniform over shapes and delta lights, then by area, as `path` samples them
  kPower,     ///< in proportion to the power, the mean of its channels, by light_selection.h
  kLearned,   ///< first as kPower; who learns from samples changes it by LightSet::change()
};

/// "triangle", "shape", "power", "learned".
std::string name_of(LightSelection selection);

/// One light: an emitter or a part of it, such as a triangle.
struct Light {
  const Emitter* emitter;
  uint32_t part;
  float pmf;  ///< probability of being selected, a multiple of 2^-24
};

/// Made for one scene, which must outlive it; read by many threads.
class LightSet {
 public:
  LightSet() = default;
  /// Throws Error(kInput) where there are more than 2^22 lights.
  LightSet(const Scene& scene, LightSelection selection);

  /// Changes the probabilities to multiples of 2^-24 near the parts that `weights` have in their sum: finite, not
  /// negative, one for each light, not all zero. A positive weight keeps a positive probability.
  void change(const std::vector<double>& weights);

  uint32_t size() const { return static_cast<uint32_t>(lights_.size()); }
  bool empty() const { return lights_.empty(); }
  const Light& operator[](uint32_t number) const { return lights_[number]; }

  /// The number of the light that `u` in [0, 1) chooses; there must be one. Lights of probability 0 are never chosen.
  uint32_t select(float u) const { return selection_.sample(u).index; }
  /// Samples one light as seen from `reference`; the density is that of this light, without Light::pmf.
  EmitterSample sample(uint32_t number, const Vec3& reference, Vec2 u, float u_primitive) const {
    const Light& light = lights_[number];
    return light.emitter->sample_part_towards(light.part, reference, u, u_primitive);
  }
  /// The number of the light on which a hit with an emitter lies.
  uint32_t number_of(const SurfaceHit& hit) const {
    return first_[emitters_.find(key_of(*hit.emitter))] + hit.emitter->part_of(hit);
  }
  /// Asks memory for what sample() reads of a light first.
  void prefetch(uint32_t number) const { __builtin_prefetch(&lights_[number]); }
  /// Density of sample() of that light per unit solid angle at `reference`.
  static float pdf_solid_angle(const Vec3& reference, const SurfaceHit& hit) {
    return hit.emitter->pdf_part_solid_angle(reference, hit);
  }

 private:
  static uint64_t key_of(const Emitter& emitter) { return reinterpret_cast<uintptr_t>(&emitter); }

  LargeVector<Light> lights_;    // the parts of an emitter one after another
  KeyIndex emitters_;            // by address
  std::vector<uint32_t> first_;  // number of the first part of each of emitters_
  Discrete selection_;
};

/// Clusters of the lights of a set, at most `limit` (at least 1); see cluster_lights(). `scene`: its bounds.
LightClusters cluster_light_set(const LightSet& lights, const Bounds3& scene, uint32_t limit);

/// The expected number of samples that a vertex takes of each cluster, which takes one of the whole set.
std::vector<float> expected_samples(const LightClusters& clusters, const LightSet& lights);

}  // namespace covary
