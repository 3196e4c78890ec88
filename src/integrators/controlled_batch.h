// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "integrators/light_samples.h"
#include "integrators/path_batch.h"
#include "sampling/coefficient_cache.h"

namespace covary {

/// A vertex whose samples are not complete yet: its light samples, and the direction sample, which is known once the
/// next surface is found.
struct ControlledVertex {
  bool open = false;                        ///< light techniques are used
  Spectrum throughput;                      ///< of the path before the vertex
  Spectrum direction_weight;                ///< f cos / pdf of the direction sample
  uint32_t cell = CoefficientTable::kNone;  ///< cell of its coefficients; kNone: no control
  Spectrum albedo_scale{1};                 ///< factor on the coefficients
  Spectrum control;  ///< what the control adds to the plain estimate so far, divided by the albedo scale

  // Only while learning coefficients:
  bool recorded = false;
  uint32_t sums_cell = 0;  ///< of ControlledBatch::sums
  float weight = 0;        ///< of its samples in the sums
  Spectrum weights;        ///< per channel
  Spectrum plain;          ///< the plain estimate so far, without the throughput, divided by the albedo scale
};

struct ControlledPathState : PathState {
  uint32_t last_vertex = 0;  ///< address of the numbers of the last vertex
};

struct ControlledChoice : LightSetChoice {
  bool in_cell = false;  ///< key is valid: where its coefficients are learnt and looked up
  CellKey key;
  uint32_t cell = CoefficientTable::kNone;  ///< of the table
};

struct ControlledConnection {
  Spectrum value;     ///< f/p
  uint32_t sample;    ///< of the path
  uint32_t cluster;   ///< sampled, or ControlledSample::kNoLight: the environment
  float r_technique;  ///< balance weight of the technique that took the sample
};

/// The batch of ControlledTracer.
struct ControlledBatch final : CameraBatch<ControlledPathState, ControlledChoice, ControlledConnection> {
  void start(size_t n) {
    CameraBatch::start(n, 2);
    if (vertices.size() < n) environments.resize(n), vertices.resize(n);
    for (size_t i = 0; i < n; ++i) vertices[i].open = false;
  }

  std::vector<EmitterSample> environments;
  std::vector<ControlledVertex> vertices;  ///< the last vertex of each path, by Path::sample
  std::vector<uint32_t> ended;             ///< samples whose paths end at their last vertex

  bool recording = false;
  SystemSums sums;
  size_t last_cells = 0, last_rows = 0;  ///< of the last tile's sums: the next one is likely to need as much memory
};

}  // namespace covary
