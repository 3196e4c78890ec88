// SPDX-License-Identifier: Apache-2.0
// Control variates on the lobes that guide a path [Hua2023] (Sec. 5 and 7.5). Techniques of a vertex are the lobes of
// its leaf, the BSDF, and with light samples the environment and the lights. Each has its coefficient in the leaf:
//
//     control = Σ_k N_k β_k − Σ_s Σ_k β_k r_k(s),     r_k = N_k λ_k / p,
//
// has the expectation zero whatever the coefficients are (sampling/coefficient_solver.h). Lobes are weighted by the
// cosine at the vertex, so N_k belongs to the vertex and β_k to the leaf.
#pragma once

#include <array>
#include <span>

#include "sampling/coefficient_table.h"
#include "sampling/guiding_field.h"

namespace covary {

/// Numbers of the dense techniques.
struct GuidedTechnique {
  static constexpr uint32_t kSmallLobes = VmfLobes::kMax;  ///< all lobes of little weight together
  static constexpr uint32_t kBsdf = kSmallLobes + 1;
  static constexpr uint32_t kEnvironment = kBsdf + 1;
  static constexpr uint32_t kCount = kEnvironment + 1;
  static constexpr float kSmallWeight = 0.01f;  ///< lobes below are one technique
  /// That of lobe k of a leaf.
  static uint32_t of(const GuidingLeaf& leaf, int k) {
    return leaf.mixture.lobes.weight[k] < kSmallWeight ? kSmallLobes : static_cast<uint32_t>(k);
  }
};

/// Coefficients are looked up by the leaf whose lobes they belong to.
inline CellKey control_key(uint32_t leaf) {
  return {leaf & CellKey::kMaxCoordinate, leaf >> 17, 0, CellGrid::kEveryNormal, 0};
}

/// Of a direction: N_k λ_k of each dense technique.
using TechniqueDensities = std::array<float, GuidedTechnique::kCount>;

/// A vertex whose direction sample is not finished.
struct ControlledVertexState {
  bool active = false;                      ///< it has a control, or teaches one
  uint32_t cell = CoefficientTable::kNone;  ///< of its coefficients; kNone: no control
  Spectrum throughput;                      ///< of the path before the vertex
  Spectrum control;                         ///< so far
  Spectrum direction;   ///< Σ_k β_k N_k λ_k / Σ_k N_k λ_k of the direction sample, dense techniques
  uint32_t step = ~0u;  ///< place of what it teaches, if anything
};

/// What a vertex teaches, once its path has ended.
struct ControlStep {
  uint32_t cell = 0;  ///< of the sums
  float weight = 0;   ///< of its samples in the sums
  uint32_t light = ControlledSample::kNoLight;
  float r_light = 0;          ///< of the light that could have found the direction sample
  TechniqueDensities r = {};  ///< balance weights of the direction sample
  Spectrum throughput;        ///< of the path before the vertex
  Spectrum before;            ///< radiance of the path before the direction was followed
  Spectrum own;               ///< part of the radiance since then that is the vertex's own control
  Spectrum plain, control;    ///< estimate without control, of light samples so far, and unscaled control
  bool followed = false;      ///< the direction was followed; otherwise it found nothing
  bool held_out = false;      ///< there was a control
};

}  // namespace covary
