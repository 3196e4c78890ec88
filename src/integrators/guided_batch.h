// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "integrators/guided_control.h"
#include "integrators/light_samples.h"
#include "integrators/path_batch.h"
#include "sampling/guiding_field.h"

namespace covary {

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
