// SPDX-License-Identifier: Apache-2.0
// Russian roulette: randomly terminates paths of low throughput and reweights the survivors.
#pragma once

#include <algorithm>
#include <cmath>

#include "core/random.h"
#include "core/spectrum.h"

namespace covary::roulette {

/// Survival probability of a path of this throughput, at most 0.95. `eta`: product of the relative indices of
/// refraction crossed, which undoes the radiance scaling by refraction. By the brightest channel; with common random
/// numbers, its fourth root: few paths with large weights are what neighbouring pixels share least, so longer paths pay
/// off there (docs/notes/performance.md, "Roulette").
inline float survival_probability(const Spectrum& throughput, float eta, Sampling sampling) {
  const float brightest = max_component(throughput) * sqr(eta);
  return std::min(sampling == Sampling::kCrn ? std::sqrt(std::sqrt(brightest)) : brightest, 0.95f);
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
