// SPDX-License-Identifier: Apache-2.0
// Russian roulette: ends a path that carries little with some probability, and raises what the others carry.
#pragma once

#include <algorithm>
#include <cmath>

#include "core/random.h"
#include "core/spectrum.h"

namespace covary::roulette {

/// Probability that a path of this throughput goes on, at most 0.95. `eta`: product of the indices crossed, which
/// undoes the scaling of radiance by refraction. After the brightest channel; with common random numbers its fourth
/// root: few paths with large weights are what neighbouring pixels share least, so longer paths pay off there
/// (docs/notes/performance.md, "Roulette").
inline float survival_probability(const Spectrum& throughput, float eta, Sampling sampling) {
  const float brightest = max_component(throughput) * sqr(eta);
  return std::min(sampling == Sampling::kCrn ? std::sqrt(std::sqrt(brightest)) : brightest, 0.95f);
}

/// What the throughput of a survivor is multiplied with.
inline float survivor_weight(float survival) { return 1 / survival; }

/// Both as parts of a tracer, which tests exchange (path_tracer.h).
struct Parts {
  float survival_probability(const Spectrum& throughput, float eta, Sampling sampling) const {
    return roulette::survival_probability(throughput, eta, sampling);
  }
  float survivor_weight(float survival) const { return roulette::survivor_weight(survival); }
};

}  // namespace covary::roulette
