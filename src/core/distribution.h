// SPDX-License-Identifier: Apache-2.0
// Sampling from tabulated distributions by inversion, which maps neighbouring numbers to neighbouring results.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/vec.h"

namespace covary {

/// Discrete distribution over indices 0 … n-1 with given non-negative weights.
class Discrete {
 public:
  Discrete() = default;
  /// Throws Error(kInput) when weights are empty, negative, not finite or all zero.
  explicit Discrete(std::span<const float> weights);

  struct Result {
    uint32_t index;
    float pmf;       ///< probability of `index`
    float remapped;  ///< `u` rescaled within its cell: again uniform in [0, 1), independent of index
  };
  /// `u` in [0, 1). Indices of zero weight are never returned.
  Result sample(float u) const {
    // The first cell whose upper bound exceeds u; its weight is positive because its bounds differ. After the guide
    // table, the search takes about one step on average (Chen and Asau 1974).
    const auto n = static_cast<uint32_t>(guide_.size());
    uint32_t index = guide_[std::min(static_cast<uint32_t>(u * static_cast<float>(n)), n - 1)];
    while (cdf_[index + 1] <= u) ++index;
    const float lower = cdf_[index], width = cdf_[index + 1] - lower;
    return {index, width, std::min((u - lower) / width, kOneMinusEpsilon)};
  }
  float pmf(uint32_t index) const { return cdf_[index + 1] - cdf_[index]; }
  uint32_t size() const { return static_cast<uint32_t>(cdf_.size()) - 1; }
  /// Sum of the weights as given.
  double sum() const { return sum_; }

 private:
  std::vector<float> cdf_;       // n + 1 values from 0 to 1
  std::vector<uint32_t> guide_;  // for each of n equal intervals of u, the first cell that reaches into it
  double sum_ = 0;
};

/// Same as Discrete, but by an alias table (Walker 1977, Vose 1991): one memory access, but neighbouring numbers may
/// give distant indices. For large tables whose result does not depend on the pixel.
class AliasTable {
 public:
  /// Throws like Discrete.
  explicit AliasTable(std::span<const float> weights);
  struct Result {
    uint32_t index;
    float remapped;  ///< again uniform in [0, 1), independent of index
  };
  /// Prefetches what sample(u) will read.
  void prefetch(float u) const { __builtin_prefetch(&cells_[cell_of(u * static_cast<float>(cells_.size()))]); }
  /// `u` in [0, 1).
  Result sample(float u) const {
    const float x = u * static_cast<float>(cells_.size());
    const uint32_t i = cell_of(x);
    const Cell& cell = cells_[i];
    // Select values instead of branching: a misprediction would be noticed only once memory has answered.
    const float f = x - static_cast<float>(i);
    const bool own = f < cell.own;
    const float lower = own ? 0 : cell.own, width = own ? cell.own : 1 - cell.own;
    return {own ? i : cell.other, std::min((f - lower) / width, kOneMinusEpsilon)};
  }

 private:
  struct Cell {
    float own;       // fraction of the cell that belongs to its own index
    uint32_t other;  // index of the rest
  };
  /// `x` in [0, n].
  uint32_t cell_of(float x) const {
    return std::min(static_cast<uint32_t>(x), static_cast<uint32_t>(cells_.size()) - 1);
  }
  std::vector<Cell> cells_;
};

/// Piecewise-constant density on [0,1]^2 over a grid of width x height cells, row-major.
class PiecewiseConstant2D {
 public:
  PiecewiseConstant2D() = default;
  /// Throws Error(kInput) like Discrete.
  PiecewiseConstant2D(std::span<const float> weights, int width, int height);

  struct Result {
    Vec2 uv;
    float pdf;  ///< per unit area of [0,1]^2
  };
  Result sample(Vec2 u) const;
  /// Density at `uv` in [0,1)^2, per unit area of the unit square.
  float pdf(Vec2 uv) const;
  int width() const { return width_; }
  int height() const { return height_; }

 private:
  int width_ = 0, height_ = 0;
  Discrete rows_;
  std::vector<Discrete> columns_;  // one per row; empty rows hold a uniform one that is never sampled
};

}  // namespace covary
