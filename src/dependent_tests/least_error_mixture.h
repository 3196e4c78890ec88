// SPDX-License-Identifier: Apache-2.0
// The mixture of images with the least estimated error, Mallows' C_p [Mallows1973]. Given the noisy mean C_i of a
// pixel's independent samples, and images X_j that are linear in such means with weights that do not depend on them,
// o_j being the weight of the pixel itself (filtered images, or an image of other samples with o_j = 0),
//
//     G = C_i + sum_j a_j (X_j - C_i)
//
// has the expected squared error, up to a constant, of [Mallows1973]
//
//     sum_jk a_j a_k <X_j - C_i, X_k - C_i> - 2 sum_j a_j v (1 - o_j),        v = sum over channels of var C_i,
//
// estimated without bias, whatever the errors of X_j: noise, distortion, or errors common to whole regions. It is
// summed over a window around each pixel, with the weights of relMSE, and minimised over a >= 0, sum a <= 1. As v tends
// to 0, so do the a_j of images with a remaining error. Weights have the brightness of C_i, averaged over 7 x 7 pixels;
// beside a light this is far too much for dark pixels, so that light that leaks into them would hardly count.
#pragma once

#include <span>
#include <vector>

#include "filters/filter_input.h"

namespace covary {

struct MixtureCandidate {
  const Image* colour = nullptr;      ///< X_j, RGB
  const Image* own_weight = nullptr;  ///< o_j, one channel; null: 0
};

/// Maximum number of candidates.
inline constexpr int kMixtureCandidates = 3;

/// `noise`: one plane, v of each pixel. Pixels that are invalid or without samples (input.count) are left out of the
/// sums and keep their C_i. `window`: side of the windows of the sums, odd. `brightest`: one plane, for weights the
/// most that a pixel's brightness can be, or null. Bit-identical for any number of threads.
Image least_error_mixture(const FilterInput& input, const Planes& noise, const std::vector<unsigned char>& valid,
                          std::span<const MixtureCandidate> candidates, int window, const Planes* brightest = nullptr);

/// Radius of influence of input and candidates on a pixel, in rows or columns.
int least_error_mixture_halo(int window);

}  // namespace covary
