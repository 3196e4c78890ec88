// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "core/in_place.h"
#include "integrators/path_batch.h"
#include "sampling/coefficient_cache.h"

namespace covary {

/// A vertex whose samples are not all taken yet: its light samples, and the direction sample, which is known when the
/// next surface is found.
struct ControlledVertex {
  bool open = false;                        ///< light techniques take part
  Spectrum throughput;                      ///< of the path before the vertex
  Spectrum direction_weight;                ///< f cos / pdf of the direction sample
  uint32_t cell = CoefficientTable::kNone;  ///< where its coefficients lie; kNone: no control
  Spectrum control;                         ///< what the control adds to the plain estimate, so far

  // While coefficients are learnt:
  bool recorded = false;
  uint32_t sums_cell = 0;  ///< of ControlledBatch::sums
  float weight = 0;        ///< of its samples in the sums
  Spectrum plain;          ///< the plain estimate without the throughput, so far
};

/// Camera paths that ControlledTracer advances together, and for each of them what its loops hand on to one another.
struct ControlledBatch final : ThreadState {
  /// What a path that goes on carries.
  struct Path : PathBatch::Path {
    uint32_t last_vertex = 0;  ///< address of the numbers of the last vertex
  };

  /// What a vertex samples, and with which numbers.
  struct LightChoice {
    bool open = false;   ///< the surface can use light samples
    uint32_t light = 0;  ///< number of the light
    Vec2 u, u_environment;
    float u_primitive = 0;
    bool in_cell = false;  ///< key says where its coefficients are learnt and looked up
    CellKey key;
  };

  /// A light sample that counts if nothing lies between.
  struct Connection {
    Spectrum value;     ///< f/p
    uint32_t sample;    ///< of the path
    uint32_t cluster;   ///< that was sampled, or ControlledSample::kNoLight: the environment
    float r_technique;  ///< balance weight of the technique that took the sample
  };

  /// Makes room for n fresh paths; what else the arrays hold is old and is overwritten before it is read.
  void start(size_t n) {
    paths.resize(n), rays.resize(n);
    for (Path& path : paths) make_in_place(path, [] { return Path(); });
    if (hits.size() < n)
      ray_hits.resize(n), hits.resize(n), choices.resize(n), lights.resize(n), environments.resize(n),
          vertices.resize(n);
    if (blocked.size() < 2 * n) blocked.resize(2 * n), connections.resize(2 * n), shadow_rays.resize(2 * n);
    for (size_t i = 0; i < n; ++i) vertices[i].open = false;
    by_length.assign(n * n_lengths, Spectrum());
    n_connections = 0;
  }
  /// Keeps the first n paths.
  void resize(size_t n) { paths.resize(n), rays.resize(n); }

  std::vector<Path> paths;
  std::vector<Ray> rays;  ///< the next one of each path
  std::vector<RayHit> ray_hits;
  std::vector<SurfaceHit> hits;
  std::vector<LightChoice> choices;
  std::vector<EmitterSample> lights, environments;
  std::vector<ControlledVertex> vertices;  ///< the last one of each path, by Path::sample
  size_t n_connections = 0;
  std::vector<Connection> connections;
  std::vector<Ray> shadow_rays;  ///< one of each connection
  std::vector<uint8_t> blocked;
  std::vector<uint32_t> alive;  ///< places of the paths that go on
  std::vector<uint32_t> ended;  ///< samples of the paths that end at their last vertex

  /// Parts of the samples' radiances by the number of edges of their paths, 1 … n_lengths, one sample after another;
  /// none are kept where n_lengths is 0.
  size_t n_lengths = 0;
  std::vector<Spectrum> by_length;

  bool recording = false;
  SystemSums sums;
};

}  // namespace covary
