// SPDX-License-Identifier: Apache-2.0
// Bilinear functions on the unit square that depend on two parameters and are interpolated linearly between the
// parameters' nodes: the tables of measured materials [DupuyJakob2018].
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "core/spectrum.h"
#include "core/vec.h"

namespace covary {

/// Slices to interpolate for given parameters, with weights that sum to 1.
struct SliceMix {
  int n = 0;
  std::array<uint32_t, 4> slice{};
  std::array<float, 4> weight{};
};

/// Nodes of the two parameters, strictly increasing, at least one each. Slice i · |b| + j belongs to node (i, j).
struct ParameterNodes {
  std::vector<float> a, b;
  uint32_t n_slices() const { return static_cast<uint32_t>(a.size() * b.size()); }
  /// Parameters are clamped to the range of the nodes.
  SliceMix at(float a_value, float b_value) const;
};

/// Size of a grid: at least 2 x 2.
struct GridSize {
  int width = 2, height = 2;
  size_t n() const { return static_cast<size_t>(width) * height; }
};

/// A position in a grid: the cell's first corner and the offset in the cell.
struct GridPlace {
  size_t index;
  int x, y;
  float fx, fy;
  GridPlace(const GridSize& size, Vec2 uv);
};

/// Values of `Value` (numbers or colours).
template <typename Value>
class BilinearTable {
 public:
  BilinearTable() = default;
  /// `values`: slice by slice, each row-major.
  BilinearTable(std::vector<Value> values, GridSize size) : size_(size), values_(std::move(values)) {}
  /// Value of one slice at uv, clamped to [0, 1]².
  Value eval(uint32_t slice, Vec2 uv) const {
    const GridPlace p(size_, uv);
    return at(slice, p);
  }
  Value eval(const SliceMix& mix, Vec2 uv) const {
    const GridPlace p(size_, uv);
    Value sum = at(mix.slice[0], p) * mix.weight[0];
    for (int i = 1; i < mix.n; ++i) sum += at(mix.slice[i], p) * mix.weight[i];
    return sum;
  }

 private:
  Value at(uint32_t slice, const GridPlace& p) const {
    const Value* v = values_.data() + slice * size_.n() + p.index;
    const Value* next = v + size_.width;
    return (v[0] * (1 - p.fx) + v[1] * p.fx) * (1 - p.fy) + (next[0] * (1 - p.fx) + next[1] * p.fx) * p.fy;
  }
  GridSize size_;
  std::vector<Value> values_;
};

/// Densities on the unit square, sampled by inversion: the row by the marginal distribution, then the column. The map
/// is continuous and invertible.
class WarpTable {
 public:
  WarpTable() = default;
  /// `values`: slice by slice, each row-major, not negative; each slice is normalised to integrate to 1. Throws
  /// Error(kInput) "NAME …" for a negative value or a slice that is zero everywhere.
  WarpTable(std::vector<float> values, GridSize size, const std::string& name);

  struct Result {
    Vec2 uv;
    float pdf;  ///< per unit area of the sampled square
  };
  /// `u` in [0, 1)².
  Result sample(const SliceMix& mix, Vec2 u) const;
  /// Inverse of sample(): the u that maps to `uv`, and the density there.
  Result invert(const SliceMix& mix, Vec2 uv) const;
  float pdf(const SliceMix& mix, Vec2 uv) const;

 private:
  /// sum over slices of weight * array[slice * stride + index]
  static float mixed(const std::vector<float>& array, size_t stride, const SliceMix& mix, size_t index) {
    float sum = array[mix.slice[0] * stride + index] * mix.weight[0];
    for (int i = 1; i < mix.n; ++i) sum += array[mix.slice[i] * stride + index] * mix.weight[i];
    return sum;
  }
  float value(const SliceMix& mix, size_t index) const { return mixed(values_, size_.n(), mix, index); }
  /// Integral over row y up to column x.
  float in_row(const SliceMix& mix, int y, int x) const {
    return mixed(row_sums_, size_.n(), mix, static_cast<size_t>(y) * size_.width + x);
  }
  /// Integral from the first row to row y.
  float rows(const SliceMix& mix, int y) const {
    return mixed(sums_, static_cast<size_t>(size_.height), mix, static_cast<size_t>(y));
  }

  GridSize size_;
  std::vector<float> values_;
  std::vector<float> row_sums_;  // CDF of each row at its columns, not normalised
  std::vector<float> sums_;      // CDF over rows, not normalised
};

}  // namespace covary
