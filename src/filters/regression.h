// SPDX-License-Identifier: Apache-2.0
// Nonlinearly weighted first-order regression, collaborative: Bitterli, Rousselle, Moon et al., Comput. Graph. Forum
// 35(4), 2016 [Bitterli2016], Eqs. (5) and (6). Around every third pixel i of every third row, the colours s_j of the
// 21 x 21 pixels are fitted by a plane over their features x_j,
//
//     minimise sum_j w_ij ((s_j - a_i - b_i (x_j - x_i))^2 + r ||b_i||^2),
//
// w_ij: the weights of nl_means.h with a bandwidth of 0.5 and without guides. A pixel is the mean of what the planes
// around predict there, by w_ij, and of another filter's image with weight 1: no plane may be like a pixel.
// Slopes over positions, whose unit is not known, have a ridge in proportion to their squared differences.
#pragma once

#include <span>
#include <vector>

#include "filters/planes.h"

namespace covary {

/// Features of a pixel, beside its place in the image.
inline constexpr int kMostFeatures = 9;

/// Steering image and its standard error; what is fitted with the same weights and, for each, another filter's image.
struct RegressionInput {
  const Image* image = nullptr;
  const Image* std_error = nullptr;
  std::vector<const Image*> sources, others;
  const Image* position = nullptr;  ///< of the surfaces, in any unit; or null
  bool coarse = false;              ///< planes around every fourth pixel of every fourth row instead
};

/// The images of the sources. All images have three channels and one size, and all values are finite; they may be
/// negative, as planes are. Linear in sources and others. `features`: up to kMostFeatures channels, of about 1.
/// `valid`: pixels with 0 are not fitted, and hold the other image. Bit-identical for any number of threads.
std::vector<Image> regressed(const RegressionInput& input, std::span<const Image* const> features,
                             const std::vector<unsigned char>& valid);

}  // namespace covary
