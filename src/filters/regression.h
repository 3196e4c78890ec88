// SPDX-License-Identifier: Apache-2.0
// Nonlinearly weighted first-order regression, collaborative: Bitterli, Rousselle, Moon et al., Comput. Graph. Forum
// 35(4), 2016 [Bitterli2016], Eqs. (5) and (6). Around every third pixel i of every third row, a first-order model in
// the features x_j is fitted to the colours s_j of 21 x 21 pixels,
//
//     minimise sum_j w_ij ((s_j - a_i - b_i (x_j - x_i))^2 + r ||b_i||^2),
//
// w_ij: the weights of nl_means.h with bandwidth 0.5 and without features. A pixel is the mean of the predictions of
// the surrounding models, weighted by w_ij, and of another filter's image with weight 1, in case no model matches the
// pixel.
#pragma once

#include <span>
#include <vector>

#include "filters/planes.h"
#include "filters/wanted_rows.h"

namespace covary {

/// Maximum number of features of a pixel, beside its position.
inline constexpr int kMaxFeatures = 9;

/// Steering image and its standard error; the images fitted with the same weights and, for each, another filter's
/// image.
struct RegressionInput {
  const Image* image = nullptr;
  const Image* std_error = nullptr;
  std::vector<const Image*> sources, others;
  const Image* position = nullptr;  ///< of the surfaces, in any unit; or null
  bool coarse = false;              ///< planes around every fourth pixel of every fourth row instead
  /// Rows of a larger image begin at a multiple of kRegressionCell; those at least kRegressionHalo away from those
  /// that are missing have the bits of the whole.
  WantedRows wanted = {};
};

inline constexpr int kRegressionCell = 12;  ///< the windows of both kinds begin anew
inline constexpr int kRegressionHalo = 22;  ///< radius of influence of the input on a pixel, in rows or columns

/// The filtered sources. All images must have three channels, the same size and finite values; results may be negative,
/// as models are. Linear in sources and others. `features`: up to kMaxFeatures channels, with values of order 1.
/// `valid`: pixels with 0 are not fitted, and keep the other image. Bit-identical for any number of threads.
std::vector<Image> regressed(const RegressionInput& input, std::span<const Image* const> features,
                             const std::vector<unsigned char>& valid);

}  // namespace covary
