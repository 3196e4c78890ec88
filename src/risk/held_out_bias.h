// SPDX-License-Identifier: Apache-2.0
// The bias of an image where it is significant, by half buffers as in held_out_error.h. The same method made M_A and
// M_B from the two halves of all samples; h_A and h_B are the halves' independent images, whose expectation is correct.
// The other half decides which pixels are similar, so that the mean
//
//     d_A,i = sum_j w_ij (M_A,j - h_A,j) / sum_j w_ij,   w_ij = exp(-||G_B,j - G_B,i||^2 / ((0.5 G'_B,i)^2 + 1e-4)),
//
// and likewise d_B, is up to noise the mean bias of the halves' images over pixels similar to i, however M_A and h_A
// depend on each other. The halves are independent, and the noise of a cell is known from their difference:
//
//     b = (d_A + d_B) / 2,   s^2 = (v_A + v_B) / 4,   v_A = sum_j w_ij^2 (r_A,j - r_B,j)^2 / 2 / (sum_j w_ij)^2,
//
// r: M - h of a cell. Rare light may be missing from the similar cells but present next to them, so v is at least what
// the relative variance of all cells in the window implies. The bias is significant if |b| > 3 s, both halves agree,
// |d_A - d_B| < |b|, and at least 20 cells are similar; then the result is b (1 - s^2 / b^2), which corrects for
// selection; otherwise it is zero.
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
  const std::vector<unsigned char>* valid = nullptr;  ///< pixels with 0 are ignored and have no bias
};

/// Cells are aligned to multiples of this.
inline constexpr int kBiasCell = 4;
/// Radius of influence of the images on a pixel's bias, in rows or columns.
inline constexpr int kBiasHalo = 8 * kBiasCell;

/// The significant bias of each value, positive if the image is too bright, in linear radiance; for images made from
/// half of the samples, so that of the whole image is at most as large. Bit-identical for any number of threads.
Image held_out_bias(const HeldOutBiasInput& input);

}  // namespace covary
