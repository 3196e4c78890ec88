// SPDX-License-Identifier: Apache-2.0
// Residual feedback (ours): gives back, where it is shared, what an estimator took away.
//
// Penalties that contain the noise they judge lose energy: bright outliers of the PT image h are penalised more than dark
// ones. The bias E[h - F^] varies slowly over the image, so that a wide mean of h - F^ over pixels like the target is
// nearly free of noise, and F^, which has little noise, tells which pixels are alike:
//
//     F^'_i = F^_i + sum_j w_ij (h_j - F^_j) / sum_j w_ij,   w_ij = exp(-||F^_j - F^_i||^2 / (kappa^2 s_i^2)),
//
// s_i^2: estimated variance of F^_i, summed over RGB (Eq. (8) of the estimator).
#pragma once

#include "estimators/planes.h"

namespace covary {

struct FeedbackOptions {
  /// Side of the window; odd, 5 … 125. Default 41 (measured; 61 gains less than 1 %, 21 loses 3 %).
  int window = 41;
  /// kappa: pixels that differ by so many standard errors of the estimate have weight 1 / e; > 0. Less leaves less bias and
  /// more noise. Default 2.5 (measured, docs/methods/iicv.md: a fifth to a half less squared bias than 8 at 2 % more error).
  float bandwidth = 2.5f;
};

/// Adds the feedback to `estimate`, whose standard error is `std_error`. `h`: 3 planes, mean of the PT image. The sums run over cells of 2 x 2 pixels (means of
/// F^ and of h - F^), aligned with even coordinates. Pixels with 0 in
/// `valid` are left out and left alone.
void add_feedback(const Planes& h, const FeedbackOptions& options, const std::vector<unsigned char>& valid,
                  const Image& std_error, Image& estimate);

}  // namespace covary
