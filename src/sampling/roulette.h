// SPDX-License-Identifier: Apache-2.0
// Russian roulette: randomly terminates paths of low throughput and reweights the survivors.
#pragma once

#include <algorithm>
#include <cmath>

#include "core/random.h"
#include "core/spectrum.h"

namespace covary::roulette {

/// Survival probability of a path of this throughput, at most 0.95. `eta`: product of the relative indices of
/// refraction crossed, which undoes the radiance scaling by refraction. The root of the brightest channel: its
/// survivors have less spread weights than those of the throughput itself, for a few longer paths. With common random
/// numbers, its fourth root: few paths with large weights are what neighbouring pixels share least
/// (docs/notes/performance.md, "Roulette").
inline float survival_probability(const Spectrum& throughput, float eta, Sampling sampling) {
  const float root = std::sqrt(max_component(throughput) * sqr(eta));
  return std::min(sampling == Sampling::kCrn ? std::sqrt(root) : root, 0.95f);
}

/// Factor on a survivor's throughput.
inline float survivor_weight(float survival) { return 1 / survival; }

/// Both as parts of a tracer, which tests can replace (path_tracer.h).
struct Parts {
  float survival_probability(const Spectrum& throughput, float eta, Sampling sampling) const {
    return roulette::survival_probability(throughput, eta, sampling);
  }
  float survivor_weight(float survival) const { return roulette::survivor_weight(survival); }
};

}  // namespace covary::roulette
