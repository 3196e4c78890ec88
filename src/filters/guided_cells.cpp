// SPDX-License-Identifier: Apache-2.0
#include "filters/guided_cells.h"

namespace covary {

using namespace lanes;

namespace {

constexpr float kBandwidth = 0.5f;     // of the target's brightness
constexpr float kLeastSquare = 1e-4f;  // of the bandwidth

}  // namespace

void GuidedCells::sum(int x, int y, vfloat* sums) const {
  vfloat f[3];
  for (int c = 0; c < 3; ++c)
    for (int l = 0; l < kLanes; ++l) f[c][l] = guide_.pixel(std::min(x + l, guide_.width - 1), y)[c];
  const vfloat grey = (f[0] + f[1] + f[2]) * (kBandwidth / 3);
  const vfloat factor = -1.0f / (grey * grey + kLeastSquare);
  std::fill_n(sums, count_, vfloat{});
  const int row = y / kCell;
  for (int dy = -kRadius; dy <= kRadius; ++dy)
    for (int dx = -kReach; dx <= kReach; dx += kCell) {
      vfloat distance = {};
      for (int c = 0; c < 3; ++c) {
        const vfloat difference = load(cells_.row(c, row + dy) + x + dx) - f[c];
        distance += difference * difference;
      }
      const vfloat weight = exp_of_nonpositive(distance * factor);
      for (int i = 0; i < count_; ++i) sums[i] += weight * load(cells_.row(3 + i, row + dy) + x + dx);
    }
}

}  // namespace covary
