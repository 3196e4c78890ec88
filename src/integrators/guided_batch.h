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

// Control variates on the lobes that guide a path [Hua2023] (Sec. 5 and 7.5). The techniques of a vertex are the lobes
// of its leaf, the BSDF, and with light samples the environment and the lights. Each has a coefficient in the leaf:
//
//     control = Σ_k N_k β_k − Σ_s Σ_k β_k r_k(s),     r_k = N_k λ_k / p,
//
// has expectation zero for any coefficients (sampling/coefficient_solver.h). Lobes are weighted by the cosine at the
// vertex, so N_k belongs to the vertex and β_k to the leaf.

/// Indices of the dense techniques.
struct GuidedTechnique {
  static constexpr uint32_t kSmallLobes = VmfLobes::kMax;  ///< all lobes of small weight together
  static constexpr uint32_t kBsdf = kSmallLobes + 1;
  static constexpr uint32_t kEnvironment = kBsdf + 1;
  static constexpr uint32_t kCount = kEnvironment + 1;
  static constexpr float kSmallWeight = 0.01f;  ///< lobes below this weight are merged into one technique
  /// Technique of lobe k of a leaf.
  static uint32_t of(const GuidingLeaf& leaf, int k) {
    return leaf.mixture.lobes.weight[k] < kSmallWeight ? kSmallLobes : static_cast<uint32_t>(k);
  }
};

/// Coefficients are looked up by the leaf whose lobes they belong to.
inline CellKey control_key(uint32_t leaf) {
  return {leaf & CellKey::kMaxCoordinate, leaf >> 17, 0, CellGrid::kEveryNormal, 0};
}

/// For one direction: N_k λ_k of each dense technique.
using TechniqueDensities = std::array<float, GuidedTechnique::kCount>;

/// A vertex whose direction sample is not complete yet.
struct ControlledVertexState {
  bool active = false;                      ///< it has a control, or records training data
  uint32_t cell = CoefficientTable::kNone;  ///< cell of its coefficients; kNone: no control
  Spectrum throughput;                      ///< of the path before the vertex
  Spectrum control;                         ///< so far
  Spectrum direction;   ///< Σ_k β_k N_k λ_k / Σ_k N_k λ_k of the direction sample, dense techniques
  uint32_t step = ~0u;  ///< index of its training record, if any
};

/// Training data of a vertex, complete once its path has ended.
struct ControlStep {
  uint32_t cell = 0;  ///< of the sums
  float weight = 0;   ///< of its samples in the sums
  uint32_t light = ControlledSample::kNoLight;
  float r_light = 0;          ///< of the light that could have found the direction sample
  TechniqueDensities r = {};  ///< balance weights of the direction sample
  Spectrum throughput;        ///< of the path before the vertex
  Spectrum before;            ///< radiance of the path before the direction was followed
  Spectrum own;               ///< fraction of the radiance since then that is the vertex's own control
  Spectrum plain, control;    ///< estimate without control, from light samples so far, and unscaled control
  bool followed = false;      ///< the direction was followed; otherwise it found nothing
  bool held_out = false;      ///< a control was applied
};

struct GuidedPathState : PathState {
  Spectrum bsdf_throughput{1};          ///< the throughput if the BSDF had sampled all directions
  uint32_t last_vertex = 0;             ///< address of the numbers of the last vertex
  uint32_t leaf = GuidingField::kNone;  ///< of the last surface with more than delta lobes
  float first_value = 0;  ///< throughput times GuidingLeaf::outgoing at the first vertex where the latter is known
  bool recorded = false;  ///< the last direction sample is the last recorded one of the path
};

struct GuidedConnection {
  Spectrum radiance;
  uint32_t sample;
  uint32_t place;  ///< index into GuidedBatch::connection_parts, if the vertex has a control
};

/// The batch of GuidedTracer. Path::previous_pdf is that of the mixture of BSDF and guide.
struct GuidedBatch final : CameraBatch<GuidedPathState, LightSetChoice, GuidedConnection> {
  /// What the control of a light sample needs.
  struct ConnectionParts {
    Spectrum value;      ///< f/p
    uint32_t light;      ///< sampled, or ControlledSample::kNoLight: the environment
    float r_light;       ///< its balance weight if unoccluded
    Spectrum direction;  ///< Σ β N λ / Σ N λ over the dense techniques that sample directions
  };

  /// A direction sample whose incident light is known once the path has ended.
  struct Step {
    GuidingSample sample;
    Spectrum throughput;  ///< of the path after it
    Spectrum before;      ///< radiance of the path before the direction was followed
    Spectrum arriving;    ///< throughput of the path before its vertex
    Spectrum on_arrival;  ///< radiance of the path without the vertex's light samples
  };
  /// Maximum number of recorded direction samples of a path.
  static constexpr uint32_t kMaxSteps = 16;

  void start(size_t n) {
    CameraBatch::start(n, 2);
    if (vertices.size() < n) environments.resize(n), vertices.resize(n);
    for (size_t i = 0; i < n; ++i) vertices[i].active = false;
    control_steps.clear(), control_samples.clear();
    if (!recording) return;
    n_steps.assign(n, 0);
    if (steps.size() < n * kMaxSteps) steps.resize(n * kMaxSteps);
  }
  /// The last recorded step of a path.
  Step& last_step(uint32_t sample) { return steps[sample * kMaxSteps + n_steps[sample] - 1]; }

  std::vector<EmitterSample> environments;
  std::vector<uint32_t> ended;                  ///< samples whose paths ended at their last vertex, which has a control
  std::vector<ControlledVertexState> vertices;  ///< the last vertex of each path, by Path::sample
  std::vector<ConnectionParts> connection_parts;
  std::vector<TechniqueDensities> connection_weights;  ///< per direction technique, while learning coefficients

  bool recording = false;
  std::vector<uint32_t> n_steps;       ///< recorded steps of each path, by Path::sample
  std::vector<Step> steps;             ///< kMaxSteps per path
  std::vector<GuidingSample> records;  ///< from finished paths, until collected

  bool recording_control = false;
  std::vector<ControlStep> control_steps;  ///< of this batch
  std::vector<uint32_t> control_samples;   ///< Path::sample of each of them
  SystemSums sums;                         ///< until collected
};

}  // namespace covary
