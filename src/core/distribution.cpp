// SPDX-License-Identifier: Apache-2.0
#include "core/distribution.h"

#include <algorithm>
#include <string>

#include "core/error.h"

namespace covary {

Discrete::Discrete(std::span<const float> weights) : cdf_(weights.size() + 1) {
  if (weights.empty()) throw Error(ErrorCode::kInput, "a distribution needs at least one weight");
  for (size_t i = 0; i < weights.size(); ++i) {
    if (!(weights[i] >= 0) || !std::isfinite(weights[i]))
      throw Error(ErrorCode::kInput, "weight " + std::to_string(i) + " of a distribution is " +
                                         std::to_string(weights[i]) + ", not a finite number >= 0");
    sum_ += weights[i];
  }
  if (sum_ <= 0) throw Error(ErrorCode::kInput, "all weights of a distribution are zero");
  double running = 0;
  for (size_t i = 0; i < weights.size(); ++i) {
    running += weights[i];
    cdf_[i + 1] = static_cast<float>(running / sum_);
  }
  // Rounding must not leave a gap below one; cells of zero weight at the end get the same bound and stay empty.
  for (size_t i = weights.size(); i > 0 && (i == weights.size() || weights[i] == 0); --i) cdf_[i] = 1;
}

Discrete::Result Discrete::sample(float u) const {
  // First cell whose upper bound exceeds u; it has positive weight because its bounds differ.
  const auto upper = std::upper_bound(cdf_.begin() + 1, cdf_.end() - 1, u);
  const auto index = static_cast<uint32_t>(upper - cdf_.begin()) - 1;
  const float lower = cdf_[index], width = cdf_[index + 1] - lower;
  return {index, width, std::min((u - lower) / width, kOneMinusEpsilon)};
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
  return {{std::min((column.index + column.remapped) / width_, kOneMinusEpsilon),
           std::min((row.index + row.remapped) / height_, kOneMinusEpsilon)},
          row.pmf * column.pmf * width_ * height_};
}

float PiecewiseConstant2D::pdf(Vec2 uv) const {
  const int x = std::clamp(static_cast<int>(uv.x * width_), 0, width_ - 1);
  const int y = std::clamp(static_cast<int>(uv.y * height_), 0, height_ - 1);
  return rows_.pmf(y) * columns_[y].pmf(x) * width_ * height_;
}

}  // namespace covary
