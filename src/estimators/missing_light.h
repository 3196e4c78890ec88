// SPDX-License-Identifier: Apache-2.0
// What the CRN image may have missed (ours). All its pixels share their samples, so that whole regions can be without
// the light of rare paths, or without any; their sample variance then is too small, or zero, and says that they are
// certain. The independent image knows better: each of its pixels has samples of its own. The mean difference of both
// images over pixels that the CRN image shows alike,
//
//     D_i = sum_j w_ij (h_j - g_j) / sum_j w_ij,   w_ij = exp(-||g_j - g_i||^2 / (sigma^2(g_i) + tau_i^2)),
//
// is what is missing from g_i. tau is a quarter of the difference of both images over the whole window, beyond its own
// noise, so that pixels count as alike that differ by little compared with the light they lack. With v the variance of
// D, V the mean variance of h in the same pixels, and sigma^2(g_i), all summed over RGB, the missing light is
//
//     c_i = D_i sqrt(1 - s_i (sigma^2(g_i) + v_i) / ||D_i||^2)^+    where D is positive,
//     s_i = 9 min(1, 100 sigma^2(g_i) / V_i), but at least 2,
//     c_i = D_i                                                     where sigma(g_i) = 0.
//
// So nothing is missing where the noise of both images explains the difference, as nearly everywhere, and where both
// are equal in all pixels alike, such as lights seen directly. Samples of g_i have the distribution of those of h_i:
// where their variance is far below that of h, it does not tell how sure g_i is, and less evidence will do: light of
// more than two samples.
#pragma once

#include <vector>

#include "filters/planes.h"

namespace covary {

/// Side of the window.
inline constexpr int kMissingWindow = 11;

/// 3 planes: c. `g`, `h`: moments of the CRN image, with kFar outside, and of the independent image, with 0 outside;
/// their borders hold half of the window. The result has the border, and 0 outside and at invalid pixels. Pixels of
/// unequal counts count by their numbers of independent samples.
Planes missing_light(const Moments& g, const Moments& h, const std::vector<unsigned char>& valid, int border);

}  // namespace covary
