// SPDX-License-Identifier: Apache-2.0
// The error of many renders of one scene, divided into squared bias and variance, with uncertainties, and signs that
// the renders and the references do not belong together.
//
// K renders F_s with seeds of their own, references R1, R2 with samples of their own, R = (R1 + R2)/2. Means <x> are
// over pixels and channels, weighted by 1/(R'^2 + 0.01) for relMSE (R': mean of a pixel's channels) and by 1 for MSE.
//     error         mean over s of <(F_s - R1)(F_s - R2)>
//     variance      sum over s of <(F_s - F)^2> / (K - 1), F: mean of the renders
//     squared bias  mean over pairs s != t of <(F_s - R1)(F_t - R2)> = error - variance
// All three are unbiased; error and squared bias can come out negative. Standard errors: jackknife over the seeds, and
// for error and squared bias the references' share, <2 (F - R)(R1 - R2)/2> squared pixel by pixel.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "film/film.h"
#include "lab/statistics.h"

namespace covary::lab {

struct SplitError {
  Estimate error;                 ///< over seeds; no interval with one seed
  Estimate squared_bias;          ///< from two seeds on; with interval from three on
  Estimate variance;              ///< of one render; likewise
  std::vector<double> of_render;  ///< the error of each render
};

struct ErrorSplit {
  size_t n_references = 0;
  uint64_t n_pixels = 0, n_non_finite = 0;  ///< pixels not finite in any render or reference are left out
  SplitError relative, absolute;            ///< relMSE and MSE
  Estimate mean_ratio;                      ///< mean of the renders over mean of the references
  std::vector<double> mean_ratio_of_render;
  /// relMSE of R itself: <(R1 - R2)^2 / 4>; errors far below it cannot be told apart.
  double reference_error = 0;
  /// Standard normal where the renders have no samples in common with one reference more than with the other, and both
  /// references are equally good: sum of (F - R)(R1 - R2) over its root of squares.
  double reference_lean = 0;
  /// The same for each render against the mean of the others, which unequal references do not disturb; empty for K = 1.
  std::vector<double> reference_lean_of_render;
};

/// At least one render; one reference or two of the size of the renders, linear RGB. With one reference, its noise
/// counts as squared bias and there is nothing to say about leans. Throws Error(kInput) when sizes differ or no pixel
/// is left.
ErrorSplit split_error(std::span<const Image> renders, std::span<const Image> references);

/// What is suspicious about a split, in sentences; empty when nothing is. `unbiased`: the renders are expected to have
/// no bias (plain path tracing), so that a squared bias is a sign of a reference that is not of this scene.
std::vector<std::string> suspicions(const ErrorSplit& split, bool unbiased);

}  // namespace covary::lab
