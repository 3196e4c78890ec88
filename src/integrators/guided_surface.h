// SPDX-License-Identifier: Apache-2.0
// Directions at one vertex of a guided path: the mixture of the BSDF and the field learnt there.
#pragma once

#include <algorithm>
#include <cmath>
#include <span>

#include "integrators/primary_sample.h"
#include "sampling/coefficient_table.h"
#include "sampling/guiding_field.h"
#include "sampling/light_set.h"
#include "sampling/roulette.h"
#include "scene/bsdf.h"
#include "scene/surface_hit.h"

namespace covary {

/// BSDF lobes of lower roughness are not guided (docs/notes/guiding.md).
constexpr float kMinGuidedRoughness = 0.3f;

/// Constant while paths are traced.
struct GuidedScene {
  const LightSet* lights;      ///< sampled at each vertex; null: no light samples
  const Emitter* environment;  ///< as sampled, or null
  const GuidingField* field;
  float fraction;                        ///< of guided directions
  const CoefficientTable* table;         ///< control-variate coefficients; without cells: no control
  std::span<const uint32_t> cluster_of;  ///< cluster of each light
};

/// The correct parts.
struct GuidedParts {
  /// Density of the mixture of BSDF and guide, with the fraction `g` of guided directions.
  static float mixture_pdf(float g, float pdf_bsdf, float pdf_guide) { return (1 - g) * pdf_bsdf + g * pdf_guide; }
  /// Whether a failed direction counts as a sample of the control.
  static constexpr bool kCountFailed = true;
  /// The cell of the coefficients for a direction at a vertex whose Σ N β comes from `cell`.
  static uint32_t direction_cell(uint32_t cell, uint32_t /*n_cells*/) { return cell; }
  /// Factor on the throughput of survivors of roulette.
  static float survivor_weight(float survival) { return roulette::survivor_weight(survival); }
  /// Samples a direction from the lobes `guide` of a leaf.
  static Vec3 sample_guide(const VmfLobes& guide, const GuidingField&, uint32_t /*leaf*/, float u_lobe, Vec2 u) {
    return guide.sample(u_lobe, u);
  }
};

/// Probability of the BSDF lobes that guiding can replace: those whose density in the mirror direction is at most that
/// of a microfacet lobe with the given roughness α, D / (4 cos θ) <= 1 / (4 π α² cos θ) [Walter2007] Eq. (14). Excludes
/// delta lobes. 0 for surfaces that transmit light other than by delta lobes.
inline float guidable_fraction(const BsdfClosure& bsdf, const Vec3& wo, float min_roughness) {
  if (bsdf.flags() & (kGlossyTransmission | kDiffuseTransmission)) return 0;
  float pmfs[kMaxLobes], pdfs[kMaxLobes];
  bsdf.lobe_pmfs(wo, pmfs);
  bsdf.lobe_pdfs(wo, reflect(wo), pdfs);
  const float inverse_limit = 4 * kPi * sqr(min_roughness) * std::abs(wo.z);
  float fraction = 0;
  for (int l = 0; l < bsdf.n_lobes(); ++l)
    if (pdfs[l] > 0 && pdfs[l] * inverse_limit <= 1) fraction += pmfs[l];
  return std::min(fraction, 1.0f);
}

/// A direction with its densities per unit solid angle.
struct GuidedDirection {
  BsdfSample sample;  ///< weight and pdf are those of the mixture
  float pdf_bsdf = 0, pdf_guide = 0;
};

/// Direction sampling at a vertex.
template <typename Parts>
struct Guide {
  float guidable = 0;  ///< probability of the BSDF lobes that guiding can replace
  float fraction = 0;  ///< g; 0: BSDF only
  uint32_t leaf = 0;
  VmfLobes lobes;
  alignas(32) float parts[VmfLobes::kMax];  ///< of pdf(), by lobe, if the guide samples directions

  /// Sets fraction and lobes to those of the leaf at a surface seen from `wo`, if guidable > 0 and the leaf can guide.
  void see(const GuidedScene& guided, const SurfaceHit& hit, const Vec3& wo) {
    const GuidingLeaf& own = guided.field->leaf(leaf);
    if (guidable == 0 || own.mixture.lobes.n == 0) return;
    fraction = guidable * guided.fraction;
    own.mixture.see_from(hit.p, lobes);
    lobes.multiply_by_cosine(wo.z > 0 ? hit.frame.n : -hit.frame.n);
  }

  /// Density of the lobes; sets parts.
  float pdf(const Vec3& w) { return fraction > 0 ? lobes.pdfs(w, parts) : 0; }
  float mixture_pdf(float pdf_bsdf, float pdf_guide) const {
    return fraction > 0 ? Parts::mixture_pdf(fraction, pdf_bsdf, pdf_guide) : pdf_bsdf;
  }

  GuidedDirection sample(const GuidingField& field, const SurfaceHit& hit, const Vec3& wo, const BsdfClosure& bsdf,
                         const PathRandom& random, uint32_t vertex) {
    GuidedDirection direction;
    BsdfSample& next = direction.sample;
    const float u = fraction > 0 ? random.get_1d(vertex, Event::kTechnique) : 1;
    if (u < fraction) {
      const Vec3 wi = Parts::sample_guide(lobes, field, leaf, std::min(u / fraction, kOneMinusEpsilon),
                                          random.get_2d(vertex, Event::kGuide));
      next.wi = hit.frame.to_local(wi);
      const BsdfValue f = bsdf.eval(wo, next.wi);
      direction.pdf_bsdf = f.pdf_solid_angle, direction.pdf_guide = pdf(wi);
      next.flags = kDiffuseReflection;
      next.pdf = mixture_pdf(direction.pdf_bsdf, direction.pdf_guide);
      if (next.pdf > 0) next.weight = f.value * (1 / next.pdf);
      return direction;
    }
    next = bsdf.sample(wo, random.get_1d(vertex, Event::kLobe), random.get_2d(vertex, Event::kDirection));
    direction.pdf_bsdf = next.pdf;
    if (fraction == 0 || !next.valid()) return direction;
    if (!next.is_delta()) direction.pdf_guide = pdf(hit.frame.to_world(next.wi));
    next.pdf = mixture_pdf(direction.pdf_bsdf, direction.pdf_guide);
    next.weight *= direction.pdf_bsdf / next.pdf;
    return direction;
  }
};

}  // namespace covary
