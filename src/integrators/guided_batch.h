// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "integrators/light_samples.h"
#include "integrators/path_batch.h"
#include "sampling/coefficient_table.h"
#include "sampling/guiding_field.h"

namespace covary {

// Control variates on the lobes that guide a path [Hua2023] (Sec. 5 and 7.5). Techniques of a vertex are the lobes of
// its leaf, the BSDF, and with light samples the environment and the lights. Each has its coefficient in the leaf:
//
//     control = Σ_k N_k β_k − Σ_s Σ_k β_k r_k(s),     r_k = N_k λ_k / p,
//
// has the expectation zero whatever the coefficients are (sampling/coefficient_solver.h). Lobes are weighted by the
// cosine at the vertex, so N_k belongs to the vertex and β_k to the leaf.

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

struct GuidedPathState : PathState {
  Spectrum bsdf_throughput{1};  ///< what it would be if the BSDF had drawn all directions
  uint32_t last_vertex = 0;     ///< address of the numbers of the last vertex
  bool recorded = false;        ///< the last direction sample is the last of the path's trail
};

struct GuidedConnection {
  Spectrum radiance;
  uint32_t sample;
  uint32_t place;  ///< of GuidedBatch::connection_parts, where the vertex has a control
};

/// The batch of GuidedTracer. Path::previous_pdf is that of the mixture of BSDF and guide.
struct GuidedBatch final : CameraBatch<GuidedPathState, LightSetChoice, GuidedConnection> {
  /// Of a light sample: what its control needs.
  struct ConnectionParts {
    Spectrum value;      ///< f/p
    uint32_t light;      ///< that was sampled, or ControlledSample::kNoLight: the environment
    float r_light;       ///< its balance weight where nothing lies between
    Spectrum direction;  ///< Σ β N λ / Σ N λ of the dense techniques that draw directions
  };

  /// A direction sample whose light is known when the path has ended.
  struct Step {
    GuidingSample sample;
    Spectrum throughput;  ///< of the path behind it
    Spectrum before;      ///< radiance of the path before the direction was followed
  };
  /// Direction samples of a path that are recorded; later ones are not.
  static constexpr uint32_t kMaxSteps = 16;

  void start(size_t n) {
    CameraBatch::start(n, 2);
    if (vertices.size() < n) environments.resize(n), leaves.resize(n), vertices.resize(n);
    for (size_t i = 0; i < n; ++i) vertices[i].active = false;
    control_steps.clear(), control_samples.clear();
    if (!recording) return;
    n_steps.assign(n, 0);
    if (steps.size() < n * kMaxSteps) steps.resize(n * kMaxSteps);
  }
  /// The last step of a path's trail.
  Step& last_step(uint32_t sample) { return steps[sample * kMaxSteps + n_steps[sample] - 1]; }

  std::vector<EmitterSample> environments;
  std::vector<uint32_t> leaves;  ///< of the guiding field
  std::vector<uint32_t> ended;   ///< samples of paths that ended at their last vertex, which has a control
  std::vector<ControlledVertexState> vertices;  ///< the last one of each path, by Path::sample
  std::vector<ConnectionParts> connection_parts;
  std::vector<TechniqueDensities> connection_weights;  ///< of what draws directions, while coefficients are learnt

  bool recording = false;
  std::vector<uint32_t> n_steps;       ///< of each path's trail, by Path::sample
  std::vector<Step> steps;             ///< kMaxSteps for each path
  std::vector<GuidingSample> records;  ///< of paths that have ended, until they are collected

  bool recording_control = false;
  std::vector<ControlStep> control_steps;  ///< of this batch
  std::vector<uint32_t> control_samples;   ///< Path::sample of each of them
  SystemSums sums;                         ///< until they are collected
};

}  // namespace covary
