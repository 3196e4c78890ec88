// SPDX-License-Identifier: Apache-2.0
// The bias of an image where it is significant (ours). The same method made M_A and M_B from the two halves of all
// samples; h_A and h_B are the halves' independent images, whose expectation is right. The other half decides which
// pixels are alike, so the mean
//
//     d_A,i = sum_j w_ij (M_A,j - h_A,j) / sum_j w_ij,   w_ij = exp(-||G_B,j - G_B,i||^2 / ((0.5 G'_B,i)^2 + 1e-4)),
//
// and likewise d_B, is the mean bias of the halves' images over pixels like i, up to noise, however M_A and h_A depend
// on each other. The halves are independent, and the noise of a cell is known from the difference of both:
//
//     b = (d_A + d_B) / 2,   s^2 = (v_A + v_B) / 4,   v_A = sum_j w_ij^2 (r_A,j - r_B,j)^2 / 2 / (sum_j w_ij)^2,
//
// r: M - h of a cell. Rare light may be missing from the similar cells but present beside them, so v is at least what
// the relative variance of all cells of the window implies. The bias is significant where |b| > 3 s, both halves agree,
// |d_A - d_B| < |b|, and 20 cells are alike; there the result is b (1 - s^2 / b^2), which corrects for selection;
// elsewhere it is zero.
//
// i and j are cells of 4 x 4 pixels in a window of 7 x 7 cells or, where that finds nothing, of 15 x 15 cells.
#pragma once

#include <array>
#include <vector>

#include "filters/planes.h"

namespace covary {

struct HeldOutBiasInput {
  std::array<const Image*, 2> halves = {};            ///< M_A, M_B
  std::array<const Image*, 2> guides = {};            ///< G_A, G_B: images of the same halves with little noise
  std::array<const Moments*, 2> independent = {};     ///< h_A, h_B
  const std::vector<unsigned char>* valid = nullptr;  ///< pixels with 0 are left out and have no bias
};

/// Cells are aligned with coordinates that are multiples of this.
inline constexpr int kBiasCell = 4;
/// How far from a pixel, in rows or columns, the images can influence its bias.
inline constexpr int kBiasReach = 8 * kBiasCell;

/// The significant bias of each value, positive where the image is too bright, in linear radiance; for images made of
/// half of the samples, so the whole image's is at most as large. Bit-identical for any number of threads.
Image held_out_bias(const HeldOutBiasInput& input);

}  // namespace covary
