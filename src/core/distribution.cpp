// SPDX-License-Identifier: Apache-2.0
#include "core/distribution.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "core/error.h"

namespace covary {

namespace {

/// Sum of the weights; throws if they do not form a distribution.
double checked_sum(std::span<const float> weights) {
  if (weights.empty()) throw Error(ErrorCode::kInput, "a distribution needs at least one weight");
  double sum = 0;
  for (size_t i = 0; i < weights.size(); ++i) {
    if (!(weights[i] >= 0) || !std::isfinite(weights[i]))
      throw Error(ErrorCode::kInput, "weight " + std::to_string(i) + " of a distribution is " +
                                         std::to_string(weights[i]) + ", not a finite number >= 0");
    sum += weights[i];
  }
  if (sum <= 0) throw Error(ErrorCode::kInput, "all weights of a distribution are zero");
  return sum;
}

/// The point at `fraction` of cell `index` of `n` equal cells of [0, 1). Rounding must not move it into the next cell,
/// which may be empty and is where pdf() would look.
float point_of_cell(uint32_t index, float fraction, int n) {
  const auto cell = static_cast<int>(index);
  float x = (static_cast<float>(index) + fraction) / static_cast<float>(n);
  while (static_cast<int>(x * static_cast<float>(n)) > cell) x = std::nextafter(x, 0.0f);
  while (static_cast<int>(x * static_cast<float>(n)) < cell) x = std::nextafter(x, 1.0f);
  return x;
}

}  // namespace

Discrete::Discrete(std::span<const float> weights) : cdf_(weights.size() + 1), sum_(checked_sum(weights)) {
  double running = 0;
  for (size_t i = 0; i < weights.size(); ++i) {
    running += weights[i];
    cdf_[i + 1] = static_cast<float>(running / sum_);
  }
  // Rounding must not leave a gap below one; trailing cells of zero weight get the same bound and stay empty.
  for (size_t i = weights.size(); i > 0 && (i == weights.size() || weights[i] == 0); --i) cdf_[i] = 1;

  const auto n = static_cast<uint32_t>(weights.size());
  guide_.resize(n);
  uint32_t cell = 0;
  for (uint32_t i = 0; i < n; ++i) {
    // Scaled as in sample(), so that rounding cannot make the search start past the cell.
    while (cell + 1 < n && static_cast<uint32_t>(cdf_[cell + 1] * static_cast<float>(n)) < i) ++cell;
    guide_[i] = cell;
  }
}

AliasTable::AliasTable(std::span<const float> weights) : cells_(weights.size()) {
  const double scale = static_cast<double>(weights.size()) / checked_sum(weights);
  std::vector<double> mass(weights.size());
  std::vector<uint32_t> small, large;
  for (uint32_t i = 0; i < weights.size(); ++i) {
    mass[i] = weights[i] * scale;
    (mass[i] < 1 ? small : large).push_back(i);
  }
  // Fill up each cell that is not full from one that overflows.
  while (!small.empty() && !large.empty()) {
    const uint32_t i = small.back(), from = large.back();
    small.pop_back();
    cells_[i] = {static_cast<float>(mass[i]), from};
    mass[from] -= 1 - mass[i];
    if (mass[from] < 1) small.push_back(from), large.pop_back();
  }
  // The remaining cells differ from full ones by rounding only.
  for (const std::vector<uint32_t>* rest : {&small, &large})
    for (const uint32_t i : *rest) cells_[i] = {1, i};
}

PiecewiseConstant2D::PiecewiseConstant2D(std::span<const float> weights, int width, int height)
    : width_(width), height_(height) {
  COVARY_CHECK(width > 0 && height > 0 && weights.size() == static_cast<size_t>(width) * height,
               "grid size does not match the number of weights");
  std::vector<float> sums(height);
  const std::vector<float> ones(width, 1.0f);
  columns_.reserve(height);
  for (int y = 0; y < height; ++y) {
    const auto row = weights.subspan(static_cast<size_t>(y) * width, width);
    double sum = 0;
    for (float w : row) sum += w;
    sums[y] = static_cast<float>(sum);
    columns_.emplace_back(sum > 0 ? row : std::span<const float>(ones));
  }
  rows_ = Discrete(sums);
}

PiecewiseConstant2D::Result PiecewiseConstant2D::sample(Vec2 u) const {
  const Discrete::Result row = rows_.sample(u.y);
  const Discrete::Result column = columns_[row.index].sample(u.x);
  return {{point_of_cell(column.index, column.remapped, width_), point_of_cell(row.index, row.remapped, height_)},
          row.pmf * column.pmf * width_ * height_};
}

float PiecewiseConstant2D::pdf(Vec2 uv) const {
  const int x = std::clamp(static_cast<int>(uv.x * width_), 0, width_ - 1);
  const int y = std::clamp(static_cast<int>(uv.y * height_), 0, height_ - 1);
  return rows_.pmf(y) * columns_[y].pmf(x) * width_ * height_;
}

}  // namespace covary
