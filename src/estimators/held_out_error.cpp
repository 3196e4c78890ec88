// SPDX-License-Identifier: Apache-2.0
#include "estimators/held_out_error.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "estimators/guided_cells.h"

namespace covary {
namespace {

using namespace lanes;

/// Bounds of the whole image's error over what its halves' differences tell alone: an image without bias has 1.
constexpr double kLeastFactor = 1, kLargestFactor = 100;

/// 1 / (F'^2 + 0.01), the weight of relMSE, at the guide's pixel.
float relative_weight(const Image& guide, int x, int y) {
  const Spectrum f = guide.rgb(x, y);
  const float grey = (f.r + f.g + f.b) / 3;
  return 1 / (grey * grey + 0.01f);
}

/// What relMSE sums over the pixels of a row.
struct RowSums {
  double error = 0;     ///< of the halves
  double variance = 0;  ///< of the halves
};

RowSums sums_of_row(const HeldOutInput& in, int y) {
  RowSums sums;
  for (int x = 0; x < in.guide->width; ++x) {
    if (!(*in.valid)[static_cast<size_t>(y) * in.guide->width + x]) continue;
    const double weight = relative_weight(*in.guide, x, y);
    for (int c = 0; c < 3; ++c) {
      const double m[2] = {in.halves[0]->pixel(x, y)[c], in.halves[1]->pixel(x, y)[c]};
      for (int half : {0, 1}) {
        const double residual = in.independent[1 - half]->mean.row(c, y)[x] - m[half];
        sums.error += 0.5 * weight * (residual * residual - in.independent[1 - half]->variance_of_mean.row(c, y)[x]);
      }
      sums.variance += 0.5 * weight * (m[0] - m[1]) * (m[0] - m[1]);
    }
  }
  return sums;
}

/// The image's squared error over half of the variance of the halves.
double factor_of_image(const HeldOutInput& in) {
  std::vector<RowSums> rows(static_cast<size_t>(in.guide->height));
  parallel_for(in.guide->height, 8, [&](int y) { rows[static_cast<size_t>(y)] = sums_of_row(in, y); });
  RowSums all;
  for (const RowSums& row : rows) all.error += row.error, all.variance += row.variance;
  if (!(all.variance > 0)) return kLeastFactor;
  return std::clamp((all.error - 0.5 * all.variance) / (0.5 * all.variance), kLeastFactor, kLargestFactor);
}

}  // namespace

Image held_out_error(const HeldOutInput& input) {
  const int width = input.guide->width, height = input.guide->height;
  // Half of the variance of a half, and the number of pixels, each times the weight of relMSE.
  const GuidedCells cells(*input.guide, *input.valid, 4, [&](int x, int y, float* sums) {
    const float weight = relative_weight(*input.guide, x, y);
    for (int c = 0; c < 3; ++c)
      sums[c] += 0.25f * weight * sqr(input.halves[0]->pixel(x, y)[c] - input.halves[1]->pixel(x, y)[c]);
    sums[3] += 1;
  });
  const double factor = factor_of_image(input);
  Image result(width, height, 3);
  for_each_batch(width, height, [&](int x, int y, int n) {
    std::array<vfloat, 4> sums;
    cells.sum(x, y, sums.data());
    for (int l = 0; l < n; ++l) {
      if (!(*input.valid)[static_cast<size_t>(y) * width + x + l]) continue;
      const float scale =
          static_cast<float>(factor) / (std::max(sums[3][l], 1e-20f) * relative_weight(*input.guide, x + l, y));
      for (int c = 0; c < 3; ++c) result.pixel(x + l, y)[c] = std::sqrt(scale * sums[c][l]);
    }
  });
  return result;
}

}  // namespace covary
