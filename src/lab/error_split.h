// SPDX-License-Identifier: Apache-2.0
// Splits the error of many renders of one scene into squared bias and variance, with uncertainties, and detects renders
// and references that do not belong together.
//
// K renders F_s with different seeds, references R1, R2 with independent samples, R = (R1 + R2)/2. Means <x> are over
// pixels and channels, weighted by relative_weight() (metrics/metrics.h) for relMSE and by 1 for MSE.
//     error         mean over s of <(F_s - R1)(F_s - R2)>
//     variance      sum over s of <(F_s - F)^2> / (K - 1), F: mean of the renders
//     squared bias  mean over pairs s != t of <(F_s - R1)(F_t - R2)> = error - variance
// All three are unbiased; error and squared bias can be negative. Standard errors: jackknife over the seeds, plus, for
// error and squared bias, the references' contribution, <2 (F - R)(R1 - R2)/2> squared pixel by pixel.
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
  Estimate squared_bias;          ///< needs two seeds; three for an interval
  Estimate variance;              ///< of one render; likewise
  std::vector<double> of_render;  ///< the error of each render
};

struct ErrorSplit {
  size_t n_references = 0;
  uint64_t n_pixels = 0, n_non_finite = 0;  ///< pixels that are not finite in any render or reference are left out
  SplitError relative, absolute;            ///< relMSE and MSE
  Estimate mean_ratio;                      ///< mean of the renders over mean of the references
  std::vector<double> mean_ratio_of_render;
  bool same_renders = false;  ///< several, all with the same values
  /// relMSE of R itself: <(R1 - R2)^2 / 4>; far smaller errors cannot be resolved.
  double reference_error = 0;
  double reference_noise = 0;  ///< standard error of the relMSE by the noise of two references
  /// Standard normal if the renders share no more samples with one reference than with the other, and both references
  /// are equally good: sum of (F - R)(R1 - R2) over the root of its sum of squares.
  double reference_lean = 0;
  /// The same for each render against the mean of the others, which unequal references do not affect; empty for K = 1.
  std::vector<double> reference_lean_of_render;
};

/// Needs at least one render, and one or two references of the same size, linear RGB. With one reference, its noise
/// counts as squared bias, and leaning cannot be tested. `denominators`: see compute_metric(). Throws Error(kInput) if
/// sizes differ or no pixel is left.
ErrorSplit split_error(std::span<const Image> renders, std::span<const Image> references,
                       std::span<const Image> denominators = {});

/// Suspicious findings about a split, in sentences; empty if there are none. `unbiased`: the renders are expected to
/// have no bias (plain path tracing), so a squared bias suggests a reference of another scene.
std::vector<std::string> suspicions(const ErrorSplit& split, bool unbiased);

/// Whether the image mean is not the reference's: by more than 1e-3, which chance alone would do with a probability of
/// at most 1e-3; a suspicion.
bool is_mean_off(const ErrorSplit& split);

}  // namespace covary::lab
