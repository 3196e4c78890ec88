// SPDX-License-Identifier: Apache-2.0
// The weights of a mixture of images, from sums over similar pixels.
#pragma once

#include "filters/lanes.h"

namespace covary {

/// Maximum number of candidates around a base image.
inline constexpr int kMaxCandidates = 8;

/// Number of sums in the normal equations of m candidates: the upper triangle of A row by row, b, and v.
constexpr int n_normal_sums(int m) { return m * (m + 1) / 2 + m + 1; }

/// Per lane, minimises x'Ax/2 - b'x + strength v ||x - prior||^2 / (2 m) over x >= 0, sum x <= 1. `sums`:
/// n_normal_sums(m) values; `prior`: m weights, the same in all lanes; null: zeros. `x`: receives the m weights of the
/// candidates, followed by that of the base image. A small ridge makes similar candidates share a weight.
void solve_mixture(int m, const lanes::vfloat* sums, const float* prior, float strength, lanes::vfloat* x);

}  // namespace covary
