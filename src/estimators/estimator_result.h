// SPDX-License-Identifier: Apache-2.0
// Output of the image-space estimators.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "film/film.h"

namespace covary {

/// What held-out samples tell of the error of a row of pixels (risk/held_out_error.h), relative as in relMSE: sums over
/// its values, each over F'^2 + 0.01.
struct HeldOutRow {
  double error = 0;      ///< squared error of images made of half of the samples
  double variance = 0;   ///< their variance alone
  double predicted = 0;  ///< squared standard error of the image made of all
  double squares = 0;    ///< of `error` of the parts of the row, of which there are `parts`
  int parts = 0;
};

/// What calibrate() of risk/held_out_error.h found of the predicted error.
struct HeldOutVerdict {
  double uncertainty = 0;  ///< relative standard error of the held-out error; infinite where that is not positive
  double ratio = 1;        ///< squared error that held-out samples tell, over that which the estimator predicts
};

/// What a mixture of images tells of its error and of those of its parts, each alone, as relMSE of all samples.
struct MeasuredRisks {
  double bias_share = 0;  ///< of the mixture's predicted error: what is squared bias
  struct OfImage {
    std::string name;  ///< "mean", or the estimator's; then those of the candidates
    double relmse = 0;
  };
  std::vector<OfImage> images;
};

/// What an estimator returns. `estimate` has the three channels R, G, B. `std_error` and `bias` have them too, or are
/// empty: the first where no error estimate was asked for, the second where no bias is known.
struct EstimatorResult {
  Image estimate;
  Image std_error;
  /// That of each value where it is significant, positive where too bright, zero elsewhere (risk/held_out_bias.h).
  Image bias;
  /// Pixels with a non-finite value in either input. They are left out everywhere else and show the mean of their
  /// finite groups, or zero where there are none.
  long nonfinite_pixels = 0;
  /// Of each row, for calibrate() of risk/held_out_error.h; empty where nothing was held out.
  std::vector<HeldOutRow> held_out;
  std::string note;  ///< what whoever asked for the image should know of how it was made; mostly empty
  std::optional<MeasuredRisks> risks;     ///< of mixtures with a predicted error
  std::optional<HeldOutVerdict> verdict;  ///< by calibrate(); empty where nothing was held out
};

}  // namespace covary
