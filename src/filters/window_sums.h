// SPDX-License-Identifier: Apache-2.0
// Cross-bilateral sums over the places (pixels, or cells of them) in a window that are similar to its centre.
#pragma once

#include "filters/planes.h"

namespace covary {

/// The guide planes that determine similarity, and the window.
struct AlikeWindow {
  const Planes& guide;
  int first;     ///< plane of red; green and blue follow
  int radius;    ///< in places; the border of the planes must cover the window
  int step = 1;  ///< columns from one place to the next
};

/// Calls add(w, column, row) for the places around (x + lane, y), with their weights in the lanes,
///     w = exp(-||guide - centre||^2 / bandwidth^2),   0 if the norm is huge or NaN.
/// Weights of `kAtOnce` places are computed together, to hide the latency of the exponential.
template <int kAtOnce = 1, typename Add>
[[gnu::always_inline]] inline void add_alike(const AlikeWindow& window, int x, int y, const lanes::vfloat* centre,
                                             lanes::vfloat squared_bandwidth, const Add& add) {
  using namespace lanes;
  const vfloat c0 = centre[0], c1 = centre[1], c2 = centre[2];
  const vfloat factor = -kLog2E / max(squared_bandwidth, splat(1e-30f));
  const int reach = window.radius * window.step;
  for (int row = y - window.radius; row <= y + window.radius; ++row) {
    const float* p[3];
    for (int c = 0; c < 3; ++c) p[c] = window.guide.row(window.first + c, row) + x;
    const auto exponent = [&](int dx) {
      const vfloat d0 = load(p[0] + dx) - c0, d1 = load(p[1] + dx) - c1, d2 = load(p[2] + dx) - c2;
      return squared_length(d0, d1, d2) * factor;
    };
    int dx = -reach;
    for (; dx + (kAtOnce - 1) * window.step <= reach; dx += kAtOnce * window.step) {
      vfloat w[kAtOnce];
#pragma GCC unroll 8
      for (int i = 0; i < kAtOnce; ++i) w[i] = exponent(dx + i * window.step);
#pragma GCC unroll 8
      for (int i = 0; i < kAtOnce; ++i) w[i] = exp2_of_nonpositive(w[i]);
#pragma GCC unroll 8
      for (int i = 0; i < kAtOnce; ++i) add(w[i], x + dx + i * window.step, row);
    }
    for (; dx <= reach; dx += window.step) add(exp2_of_nonpositive(exponent(dx)), x + dx, row);
  }
}

}  // namespace covary
