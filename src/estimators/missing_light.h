// SPDX-License-Identifier: Apache-2.0
// Light that the CRN image may have missed, an addition to [YM2025]. All its pixels share their samples, so that whole
// regions can lack the light of rare paths, or any light; their sample variance is then too small, or zero, and
// suggests certainty. The independent image knows better: each of its pixels has its own samples. The mean difference
// of the two images over pixels that look alike in the CRN image,
//
//     D_i = sum_j w_ij (h_j - g_j) / sum_j w_ij,   w_ij = exp(-||g_j - g_i||^2 / (sigma^2(g_i) + tau_i^2)),
//
// is what g_i lacks. tau is a quarter of the difference of the two images over the whole window, beyond its own noise,
// so that pixels count as alike if they differ by little compared with the light they lack. With v the variance of D, V
// the mean variance of h over the same pixels, and sigma^2(g_i), all summed over RGB, the missing light is
//
//     c_i = D_i sqrt(1 - s_i (sigma^2(g_i) + v_i) / ||D_i||^2)^+    where D is positive,
//     s_i = 9 min(1, 100 sigma^2(g_i) / V_i), but at least 2,
//     c_i = D_i                                                     where sigma(g_i) = 0.
//
// So nothing is missing where the noise of both images explains the difference, as almost everywhere, or where the two
// agree in all similar pixels, as for directly visible lights. Samples of g_i have the distribution of those of h_i: if
// their variance is far below that of h, it does not tell how certain g_i is, and weaker evidence suffices: light from
// more than two samples.
#pragma once

#include <vector>

#include "filters/planes.h"

namespace covary {

/// Side of the window.
inline constexpr int kMissingWindow = 11;

/// 3 planes: c. `g`: moments of the CRN image, with kFar outside; `h`: of the independent image, with 0 outside; their
/// borders must cover half the window. The result has the border `border`, and 0 outside and at invalid pixels. If
/// counts are unequal, pixels are weighted by their numbers of independent samples.
Planes missing_light(const Moments& g, const Moments& h, const std::vector<unsigned char>& valid, int border);

}  // namespace covary
