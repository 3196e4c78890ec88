// SPDX-License-Identifier: Apache-2.0
// Path tracers with a planted bug, for tests that must detect it.
#pragma once

#include "integrators/path_tracer.h"

namespace covary {

enum class Bug {
  kNone,
  kNoDirectionWeight,   ///< direction samples have no MIS weight
  kNoLightWeight,       ///< light samples have no MIS weight
  kSurvivorsNotRaised,  ///< survivors of Russian roulette are not divided by their probability
  kRadianceNotScaled,   ///< radiance is not scaled by the squared ratio of indices in refraction
  kLightPmfForgotten,   ///< light samples are not divided by the probability of their light
  kCosineForgotten,     ///< reflected light is not multiplied by the cosine
  kLobePmfForgotten,    ///< direction samples are not divided by the probability of their lobe
  kNotANumber,          ///< direction samples have a weight of NaN
};

inline const char* name_of(Bug bug) {
  constexpr const char* kNames[] = {"none",
                                    "direction samples not weighted",
                                    "light samples not weighted",
                                    "survivors of roulette not raised",
                                    "radiance not scaled by refraction",
                                    "probability of the light forgotten",
                                    "cosine forgotten",
                                    "probability of the lobe forgotten",
                                    "weight not a number"};
  return kNames[static_cast<int>(bug)];
}

class LightsWithBug : public UniformLights {
 public:
  LightsWithBug(const Scene& scene, bool forgotten) : UniformLights(scene), forgotten_(forgotten) {}
  float pmf(const Emitter& emitter) const { return forgotten_ ? 1 : UniformLights::pmf(emitter); }

 private:
  bool forgotten_;
};

/// The parts of `path`, one with a planted bug; kNone gives the bits of `path`.
struct PartsWithBug : PathParts {
  Bug bug = Bug::kNone;

  LightsWithBug lights(const Scene& scene) const { return {scene, bug == Bug::kLightPmfForgotten}; }

  BsdfSample sample_direction(const BsdfClosure& bsdf, const SurfaceHit& hit, const Vec3& wo, const PathRandom& random,
                              uint32_t vertex) const {
    BsdfSample next = PathParts::sample_direction(bsdf, hit, wo, random, vertex);
    if (!next.valid()) return next;
    if (bug == Bug::kRadianceNotScaled) next.weight *= sqr(next.eta);
    if (bug == Bug::kCosineForgotten && !next.is_delta()) next.weight *= 1 / std::abs(next.wi.z);
    if (bug == Bug::kNotANumber) next.weight = Spectrum(std::nanf(""));
    if (bug == Bug::kLobePmfForgotten) {
      float pmfs[kMaxLobes];
      bsdf.lobe_pmfs(wo, pmfs);
      next.weight *= pmfs[next.lobe];
    }
    return next;
  }
  BsdfValue eval_direction(const BsdfClosure& bsdf, const SurfaceHit& hit, const Vec3& wo, const Vec3& wi) const {
    BsdfValue f = PathParts::eval_direction(bsdf, hit, wo, wi);
    if (bug == Bug::kCosineForgotten && !is_black(f.value)) f.value *= 1 / std::abs(wi.z);
    return f;
  }

  float direction_weight(float pdf, float pdf_light) const {
    return bug == Bug::kNoDirectionWeight ? 1 : PathParts::direction_weight(pdf, pdf_light);
  }
  float light_weight_over_pdf(bool is_delta, float pdf_light, float pdf) const {
    return bug == Bug::kNoLightWeight ? 1 / pdf_light : PathParts::light_weight_over_pdf(is_delta, pdf_light, pdf);
  }
  float survivor_weight(float survival) const {
    return bug == Bug::kSurvivorsNotRaised ? 1 : PathParts::survivor_weight(survival);
  }
};

inline std::shared_ptr<Integrator> make_path_with(Bug bug, const PathLengthSettings& lengths) {
  PartsWithBug parts;
  parts.bug = bug;
  return std::make_shared<PathTracer<PartsWithBug>>("path", lengths, parts);
}

}  // namespace covary
