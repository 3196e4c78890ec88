// SPDX-License-Identifier: Apache-2.0
// Rows of a mixture of denoised images, and what its error needs of them, so that an image need not be in memory as a
// whole: the error's size follows from sums over all rows, its place from each pixel and those around.
#pragma once

#include <string>
#include <vector>

#include "denoising/candidates.h"
#include "denoising/parts_mixture.h"
#include "risk/held_out_error.h"

namespace covary {

struct MixedRows {
  /// Estimate; with an error: bias and risk_rows, and after finish() std_error and risks.
  MethodImage result;
  // Only with an error:
  HeldOutParts error;
  Image disagreement;                                  ///< of held_out_error()
  std::vector<std::vector<HeldOutRow>> of_candidates;  ///< of each candidate, a row each
  /// relMSE of the image that the candidates are mixed with, by its standard error, and the number of valid pixels.
  struct BaseRow {
    double error = 0, valid = 0;
  };
  std::vector<BaseRow> of_base;
};

/// Radius of influence of the mixture on the error, in rows; rows begin at a multiple of kResidualCell.
inline constexpr int kErrorHalo = 36;

/// Of the mixture in `mixed`, which these parts became.
MixedRows mixed_rows(const DenoisingParts& parts, const MixedParts& mixed, const std::vector<CandidateMaker>& makers,
                     bool with_error);

/// Appends n rows of `part`, starting at its row `skipped`, to `whole`, whose next row is y of `height`.
void append(const MixedRows& part, int skipped, int y, int n, int height, MixedRows& whole);

/// The result of all rows. `base`: the name of the image that the candidates are mixed with.
MethodImage finish(MixedRows whole, const std::vector<CandidateMaker>& makers, const std::string& base);

/// The names of the candidates, in their order.
std::vector<std::string> names_of(const std::vector<CandidateMaker>& makers);

}  // namespace covary
