// SPDX-License-Identifier: Apache-2.0
// A control variate for light reaching a vertex via other surfaces. No density describes it, but its direction is a
// function of two random numbers u. Their unit square is divided into K equally probable bins, and with β_k for bin k,
// learnt in spatial cells,
//
//     (1/K) Σ_k β_k − β_k(u)
//
// has expectation zero for any β. It is a system of sampling/coefficient_solver.h whose K techniques share no samples:
// N_k = 1/K, and r is 1 for the bin that was hit. The variance is minimal for β_k = mean of the light in bin k, where
// failed directions count as zero.
#pragma once

#include <algorithm>
#include <span>
#include <vector>

#include "passes/integrator.h"
#include "sampling/coefficient_table.h"

namespace covary {

/// The bins: a square of kSide x kSide. Their sides are multiples of the step of the random numbers, so that they are
/// exactly equally probable.
struct DirectionBins {
  static constexpr uint32_t kSide = 8, kCount = kSide * kSide;
  static uint32_t of(Vec2 u) {
    const auto place = [](float x) { return std::min(static_cast<uint32_t>(x * float{kSide}), kSide - 1); };
    return place(u.x) * kSide + place(u.y);
  }
  /// N_k of each bin.
  static std::vector<float> counts() { return std::vector<float>(kCount, 1.0f / kCount); }
};

/// Training records of the paths of a batch. What arrives at a vertex via other surfaces is known once the path has
/// ended.
class IndirectRecorder {
 public:
  static constexpr int kVertices = 8;  ///< vertices of a path that have a control; later ones matter little

  SystemSums sums;
  bool recording = false;

  /// A vertex of a path.
  struct Vertex {
    bool recorded = false, held_out = false;
    uint32_t cell = 0, bin = 0;
    float weight = 0;   ///< of its samples in the sums
    Spectrum scale;     ///< factor that contributions to the image are divided by
    Spectrum control;   ///< unscaled
    Spectrum fraction;  ///< fraction of the control applied in the image
  };

  /// Begins n paths.
  void start(size_t n) {
    if (!recording) return;
    vertices_.assign(n * kVertices, Vertex());
    by_length_.assign(n * kLengths, Spectrum());
  }
  Vertex& vertex(size_t path, int depth) { return vertices_[path * kVertices + static_cast<size_t>(depth)]; }
  /// Adds the contribution to the image of a path with `edges` edges.
  void add(size_t path, int edges, const Spectrum& value) {
    by_length_[path * kLengths + std::min(static_cast<size_t>(edges - 1), kLengths - 1)] += value;
  }
  /// Ends the paths: adds the records to the sums.
  void finish() {
    if (!recording) return;
    for (size_t path = 0; path * kVertices < vertices_.size(); ++path) {
      Spectrum sum = by_length_[path * kLengths + kLengths - 1];
      for (int depth = kVertices; depth-- > 0; sum += by_length_[path * kLengths + static_cast<size_t>(depth) + 1])
        if (const Vertex& v = vertex(path, depth); v.recorded) record(v, sum);
    }
  }

 private:
  // Light that other surfaces send to vertex d has d + 3 edges or more; the last entry collects all longer paths.
  static constexpr size_t kLengths = kVertices + 2;

  void record(const Vertex& v, const Spectrum& contribution) {
    Spectrum value = contribution;
    for (int c = 0; c < 3; ++c) value[c] = v.scale[c] > 0 ? value[c] / v.scale[c] - v.control[c] * v.fraction[c] : 0;
    sums.add(v.cell, v.weight, {value, v.bin, 1, {}});
    if (v.held_out) sums.add_held_out(v.cell, v.weight, value, v.control);
  }

  std::vector<Vertex> vertices_;
  std::vector<Spectrum> by_length_;
};

}  // namespace covary
