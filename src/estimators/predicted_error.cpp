// SPDX-License-Identifier: Apache-2.0
#include "estimators/predicted_error.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/error.h"

namespace covary {
namespace {

constexpr int kBlock = 16;
constexpr double kShareOfBlocks = 0.95;

/// Sum over the pixels of a part of the image, and their number.
struct PartSum {
  double total = 0;
  size_t n_pixels = 0;
  double mean() const { return n_pixels ? total / static_cast<double>(n_pixels) : 0.0; }
};

PartSum sum_over(const EstimatorResult& result, int x0, int y0, int x1, int y1) {
  const Image &f = result.estimate, &error = result.std_error;
  if (error.data.empty())
    throw Error(ErrorCode::kUsage, "predicted_relmse: the result has no standard error; set std_error in the options");
  PartSum part;
  for (int y = y0; y < y1; ++y)
    for (int x = x0; x < x1; ++x) {
      double sum = 0, squares = 0;
      for (int c = 0; c < 3; ++c) {
        sum += f.pixel(x, y)[c];
        squares += static_cast<double>(error.pixel(x, y)[c]) * error.pixel(x, y)[c];
      }
      const double relative = squares / 3 / (sum * sum / 9 + 0.01);
      if (!std::isfinite(relative)) continue;
      part.total += relative;
      ++part.n_pixels;
    }
  return part;
}

}  // namespace

double predicted_relmse(const EstimatorResult& result) {
  return sum_over(result, 0, 0, result.estimate.width, result.estimate.height).mean();
}

double predicted_blocks(const EstimatorResult& result) {
  const int width = result.estimate.width, height = result.estimate.height;
  std::vector<double> blocks;
  for (int y = 0; y < height; y += kBlock)
    for (int x = 0; x < width; x += kBlock)
      blocks.push_back(sum_over(result, x, y, std::min(width, x + kBlock), std::min(height, y + kBlock)).mean());
  if (blocks.empty()) return 0;
  const auto rank = static_cast<ptrdiff_t>(std::ceil(kShareOfBlocks * static_cast<double>(blocks.size()))) - 1;
  std::nth_element(blocks.begin(), blocks.begin() + rank, blocks.end());
  return blocks[static_cast<size_t>(rank)];
}

}  // namespace covary
