// SPDX-License-Identifier: Apache-2.0
#include "filters/guided_cells.h"

#include "filters/window_sums.h"

namespace covary {

using namespace lanes;

namespace {

constexpr float kBandwidth = 0.5f;   // relative to the target's brightness
constexpr float kMinSquare = 1e-4f;  // minimum squared bandwidth

}  // namespace

void GuidedCells::sum(int x, int y, vfloat* sums) const {
  vfloat f[3];
  for (int c = 0; c < 3; ++c)
    for (int l = 0; l < kLanes; ++l) f[c][l] = guide_.pixel(std::min(x + l, guide_.width - 1), y)[c];
  const vfloat grey = (f[0] + f[1] + f[2]) * (kBandwidth / 3);
  std::fill_n(sums, count_, vfloat{});
  add_alike({cells_, 0, kRadius, kCell}, x, y / kCell, f, grey * grey + kMinSquare, [&](vfloat w, int column, int row) {
    for (int i = 0; i < count_; ++i) sums[i] = fma(w, load(cells_.row(3 + i, row) + column), sums[i]);
  });
}

}  // namespace covary
