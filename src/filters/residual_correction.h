// SPDX-License-Identifier: Apache-2.0
// Residual correction (ours): gives back, where it is shared, what an estimator took away.
//
// Penalties that contain the noise they judge lose energy: bright outliers of the independent image h are penalised
// more than dark ones. The bias E[h - F^] varies slowly over the image, so that a wide mean of h - F^ over pixels like
// the target is nearly free of noise, and F^, which has little noise, tells which pixels are alike:
//
//     r_i(kappa) = sum_j w_ij (h_j - F^_j) / sum_j w_ij,   w_ij = exp(-||F^_j - F^_i||^2 / (kappa^2 s_i^2)),
//
// s_i^2: estimated variance of F^_i, summed over RGB (Eq. (8) of the estimator). A small kappa leaves the least bias,
// but where few pixels are alike, its mean is noisy. So two are mixed by the noise v_i of the first, summed over RGB:
//
//     F^'_i = F^_i + a_i r_i(kappa) + (1 - a_i) b_i(4 kappa) r_i(4 kappa),
//     a_i = 0.2 s_i^2 / (0.2 s_i^2 + v_i),   v_i = sum_j w_ij^2 var h_j / (sum_j w_ij)^2,
//     b_i(kappa) = s_i^2 / (s_i^2 + v_i(kappa)).
//
// Ordinary wide means have little noise, and b is near 1. One very bright sample of the independent image, a mirrored
// light say, can have more than all the light of the darker pixels around; without b all that are like it in F^ got it.
//
// The first runs over the pixels of half the window, the second over cells of 2 x 2 pixels of the whole one. Outliers
// raise their own guide, so that narrow means leave them out, and the image stays a little too dark. A second one, of
// F^' by means over cells of 4 x 4 pixels, brings that back:
//
//     F^''_i = F^'_i + b'_i(12 kappa) r'_i(12 kappa).
//
// Where pixels of the PT image have unequal counts n_j, weights are n_j w_ij.
#pragma once

#include <vector>

#include "film/film.h"

namespace covary {

struct Moments;

struct ResidualCorrectionOptions {
  /// Side of the window of the wide mean; odd, 5 … 125. Default 41 (measured; 61 gains less than 1 %, 21 loses 3 %).
  int window = 41;
  /// kappa: pixels that differ by so many standard errors of the estimate have weight 1 / e; > 0. Less leaves less bias
  /// and more noise. Default 1.25 (measured, docs/notes/iicv.md).
  float bandwidth = 1.25f;
};

/// The wide mean alone, of an image whose standard error is not known, and all of it:
///     f_i + sum_j w_ij (h_j - f_j) / sum_j w_ij,   w_ij = exp(-||f_j - f_i||^2 / ((k f'_i)^2 + 1e-4)),
/// f'_i: mean of the channels. A denoiser's bias that is shared by pixels alike goes, and texture that it lost stays
/// lost.
struct ResidualOptions {
  float bandwidth = 0.5f;  ///< k > 0
  int window = 61;         ///< side, in pixels
  int cell = 4;            ///< side of the cells over which it is taken, 2 or 4
};

/// Cells are aligned with coordinates that are multiples of this.
inline constexpr int kResidualCell = 4;
/// How far from a pixel, in rows or columns, the input can influence its correction.
inline int residual_correction_reach(const ResidualCorrectionOptions& options) {
  return 2 * (options.window / 2 + kResidualCell);
}

/// Adds the correction to `estimate`, whose standard error is `std_error`. `h`: mean of the independent image and its
/// variance. Pixels with 0 in `valid` are left out and left alone.
void add_residual_correction(const Moments& h, const ResidualCorrectionOptions& options,
                             const std::vector<unsigned char>& valid, const Image& std_error, Image& estimate);

/// Adds the residual to `estimate`; the rest as above.
void add_residual(const Moments& h, const ResidualOptions& options, const std::vector<unsigned char>& valid,
                  Image& estimate);

}  // namespace covary
