// SPDX-License-Identifier: Apache-2.0
// Residual correction: restores what an estimator removed, as far as it is common to similar pixels. Adding the
// filtered residual back is twicing [Tukey1977] (boosting of denoisers: [RomanoElad2015]); here the residual is that of
// an independent image, and F^ guides its filter.
//
// Penalties that contain the noise they judge lose energy: bright outliers of the independent image h are penalised
// more than dark ones. The bias E[h - F^] varies slowly over the image, so that a wide mean of h - F^ over similar
// pixels is nearly noise-free, and the low-noise F^ tells which pixels are similar:
//
//     r_i(kappa) = sum_j w_ij (h_j - F^_j) / sum_j w_ij,   w_ij = exp(-||F^_j - F^_i||^2 / (kappa^2 s_i^2)),
//
// s_i^2: estimated variance of F^_i, summed over RGB (Eq. (8) of the estimator). A small kappa leaves the least bias,
// but its mean is noisy where few pixels are similar. So two means are mixed according to the noise v_i of the first,
// summed over RGB:
//
//     F^'_i = F^_i + a_i r_i(kappa) + (1 - a_i) b_i(4 kappa) r_i(4 kappa),
//     a_i = 0.2 s_i^2 / (0.2 s_i^2 + v_i),   v_i = sum_j w_ij^2 var h_j / (sum_j w_ij)^2,
//     b_i(kappa) = s_i^2 / (s_i^2 + v_i(kappa)).
//
// Wide means usually have little noise, and b is near 1. But a single very bright sample of the independent image, a
// reflected light for instance, can outweigh all light of the darker pixels around; without b, it would spread to all
// similar pixels in F^.
//
// The narrow mean covers the pixels of half the window, the wide one cells of 2 x 2 pixels in the whole window.
// Outliers raise their own guide value, so that narrow means exclude them, and the image stays a little too dark. A
// second correction, of F^' by means over cells of 4 x 4 pixels, makes up for that:
//
//     F^''_i = F^'_i + b'_i(12 kappa) r'_i(12 kappa).
//
// If pixels of the independent image have unequal counts n_j, weights are n_j w_ij.
#pragma once

#include <vector>

#include "film/film.h"

namespace covary {

struct Moments;

struct ResidualCorrectionOptions {
  /// Side of the window of the wide mean; odd, 5 … 125. Default 41 (measured; 61 gains less than 1 %, 21 loses 3 %).
  int window = 41;
  /// kappa: pixels that differ by this many standard errors of the estimate have weight 1 / e; > 0. Smaller values
  /// leave less bias and more noise. Default 1.25 (measured, docs/notes/iicv.md).
  float bandwidth = 1.25f;
};

/// The wide mean only, without shrinkage, for an image whose standard error is unknown:
///     f_i + sum_j w_ij (h_j - f_j) / sum_j w_ij,   w_ij = exp(-||f_j - f_i||^2 / ((k f'_i)^2 + 1e-4)),
/// f'_i: mean of the channels. It removes a denoiser's bias that similar pixels share; texture that was lost stays
/// lost.
struct ResidualOptions {
  float bandwidth = 0.5f;  ///< k > 0
  int window = 61;         ///< side, in pixels
  int cell = 4;            ///< side of the cells, 2 or 4
};

/// Cells are aligned to multiples of this.
inline constexpr int kResidualCell = 4;
/// Radius of influence of the input on a pixel's correction, in rows or columns.
inline int residual_correction_halo(const ResidualCorrectionOptions& options) {
  return 2 * (options.window / 2 + kResidualCell);
}

/// Adds the correction to `estimate`, whose standard error is `std_error`. `h`: mean and variance of the independent
/// image. Pixels with 0 in `valid` are ignored and left unchanged. `own_weight`: optional, an image of one channel that
/// receives the weight of a pixel's own h in what is added to it, the same in all channels.
void add_residual_correction(const Moments& h, const ResidualCorrectionOptions& options,
                             const std::vector<unsigned char>& valid, const Image& std_error, Image& estimate,
                             Image* own_weight = nullptr);

/// Adds the residual to `estimate`; other arguments as above.
void add_residual(const Moments& h, const ResidualOptions& options, const std::vector<unsigned char>& valid,
                  Image& estimate);

}  // namespace covary
