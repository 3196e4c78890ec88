// SPDX-License-Identifier: Apache-2.0
#include "tensors/warp_table.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/error.h"

namespace covary {
namespace {

/// The first node of the interval containing `value`, and the interpolation weight of the second.
struct NodePlace {
  uint32_t node;
  float weight;
};

NodePlace place_between(const std::vector<float>& nodes, float value) {
  if (nodes.size() == 1) return {0, 0};
  const auto above = std::upper_bound(nodes.begin() + 1, nodes.end() - 1, value);
  const auto node = static_cast<uint32_t>(above - nodes.begin() - 1);
  return {node, std::clamp((value - nodes[node]) / (nodes[node + 1] - nodes[node]), 0.0f, 1.0f)};
}

/// The t at which the integral from 0 of the linear function from f0 (t = 0) to f1 (t = 1) reaches `area`.
float solve_segment(float area, float f0, float f1) {
  // f0 t + (f1 - f0) t² / 2 = area, in a form that is stable when f0 and f1 are nearly equal.
  const float root = f0 + safe_sqrt(f0 * f0 + 2 * area * (f1 - f0));
  return root > 0 ? std::clamp(2 * area / root, 0.0f, 1.0f) : 0;
}

/// Integral of that function from 0 to t.
float integrate_segment(float t, float f0, float f1) { return t * (f0 + 0.5f * t * (f1 - f0)); }

/// The last of cells 0 … n - 1 for which `before(cell)`, the integral up to that cell, is at most `target`.
template <typename F>
int find_cell(int n, float target, F before) {
  int low = 0, high = n;
  while (high - low > 1) {
    const int middle = (low + high) / 2;
    (before(middle) <= target ? low : high) = middle;
  }
  return low;
}

}  // namespace

SliceMix ParameterNodes::at(float a_value, float b_value) const {
  const NodePlace pa = place_between(a, a_value), pb = place_between(b, b_value);
  const auto n_b = static_cast<uint32_t>(b.size());
  SliceMix mix;
  for (uint32_t i = 0; i < 2; ++i)
    for (uint32_t j = 0; j < 2; ++j) {
      const float weight = (i ? pa.weight : 1 - pa.weight) * (j ? pb.weight : 1 - pb.weight);
      if (!(weight > 0)) continue;
      mix.slice[mix.n] = (pa.node + i) * n_b + pb.node + j;
      mix.weight[mix.n++] = weight;
    }
  return mix;
}

GridPlace::GridPlace(const GridSize& size, Vec2 uv) {
  const float u = clamp01(uv.x) * static_cast<float>(size.width - 1);
  const float v = clamp01(uv.y) * static_cast<float>(size.height - 1);
  x = std::min(static_cast<int>(u), size.width - 2);
  y = std::min(static_cast<int>(v), size.height - 2);
  fx = u - static_cast<float>(x), fy = v - static_cast<float>(y);
  index = static_cast<size_t>(y) * size.width + x;
}

WarpTable::WarpTable(std::vector<float> values, GridSize size, const std::string& name)
    : size_(size), values_(std::move(values)) {
  const size_t n_slices = values_.size() / size_.n();
  row_sums_.resize(values_.size());
  sums_.resize(n_slices * size_.height);
  for (size_t slice = 0; slice < n_slices; ++slice) {
    float* const cells = values_.data() + slice * size_.n();
    float* const row_sums = row_sums_.data() + slice * size_.n();
    float* const sums = sums_.data() + slice * size_.height;
    const auto wrong = std::find_if(cells, cells + size_.n(), [](float v) { return v < 0; });
    if (wrong != cells + size_.n())
      throw Error(ErrorCode::kInput,
                  fmt::format("'{}' has the negative value {} in slice {}; it is a density", name, *wrong, slice));
    double total = 0, last_row = 0;
    for (int y = 0; y < size_.height; ++y) {
      double row = 0;
      for (int x = 1; x < size_.width; ++x) {
        const size_t i = static_cast<size_t>(y) * size_.width + x;
        row += 0.5 / (size_.width - 1) * (static_cast<double>(cells[i - 1]) + cells[i]);
        row_sums[i] = static_cast<float>(row);
      }
      if (y > 0) total += 0.5 / (size_.height - 1) * (last_row + row);
      sums[y] = static_cast<float>(total);
      last_row = row;
    }
    const auto scale = static_cast<float>(1 / total);
    if (!(total > 0 && std::isfinite(scale)))
      throw Error(ErrorCode::kInput, fmt::format("'{}' is zero everywhere in slice {}; it is a density", name, slice));
    for (size_t i = 0; i < size_.n(); ++i) cells[i] *= scale, row_sums[i] *= scale;
    for (int y = 0; y < size_.height; ++y) sums[y] *= scale;
  }
}

WarpTable::Result WarpTable::sample(const SliceMix& mix, Vec2 u) const {
  const int n_rows = size_.height - 1, n_columns = size_.width - 1;
  const float target_y = u.y * rows(mix, n_rows);
  const int row = find_cell(n_rows, target_y, [&](int y) { return rows(mix, y); });
  const float r0 = in_row(mix, row, n_columns), r1 = in_row(mix, row + 1, n_columns);
  const float fy = solve_segment((target_y - rows(mix, row)) * static_cast<float>(n_rows), r0, r1);

  const auto before = [&](int x) { return lerp(fy, in_row(mix, row, x), in_row(mix, row + 1, x)); };
  const float target_x = u.x * before(n_columns);
  const int column = find_cell(n_columns, target_x, before);
  const size_t index = static_cast<size_t>(row) * size_.width + column;
  const float c0 = lerp(fy, value(mix, index), value(mix, index + size_.width));
  const float c1 = lerp(fy, value(mix, index + 1), value(mix, index + size_.width + 1));
  const float fx = solve_segment((target_x - before(column)) * static_cast<float>(n_columns), c0, c1);
  return {{(static_cast<float>(column) + fx) / static_cast<float>(n_columns),
           (static_cast<float>(row) + fy) / static_cast<float>(n_rows)},
          lerp(fx, c0, c1)};
}

WarpTable::Result WarpTable::invert(const SliceMix& mix, Vec2 uv) const {
  const int n_rows = size_.height - 1, n_columns = size_.width - 1;
  const GridPlace p(size_, uv);
  const float c0 = lerp(p.fy, value(mix, p.index), value(mix, p.index + size_.width));
  const float c1 = lerp(p.fy, value(mix, p.index + 1), value(mix, p.index + size_.width + 1));
  const auto before = [&](int x) { return lerp(p.fy, in_row(mix, p.y, x), in_row(mix, p.y + 1, x)); };
  const float r0 = in_row(mix, p.y, n_columns), r1 = in_row(mix, p.y + 1, n_columns);
  const float in_x = before(p.x) + integrate_segment(p.fx, c0, c1) / static_cast<float>(n_columns);
  const float in_y = rows(mix, p.y) + integrate_segment(p.fy, r0, r1) / static_cast<float>(n_rows);
  const float row = before(n_columns), all = rows(mix, n_rows);
  return {{row > 0 ? std::min(in_x / row, 1.0f) : 0, std::min(in_y / all, 1.0f)}, lerp(p.fx, c0, c1)};
}

float WarpTable::pdf(const SliceMix& mix, Vec2 uv) const {
  const GridPlace p(size_, uv);
  return lerp(p.fy, lerp(p.fx, value(mix, p.index), value(mix, p.index + 1)),
              lerp(p.fx, value(mix, p.index + size_.width), value(mix, p.index + size_.width + 1)));
}

}  // namespace covary
