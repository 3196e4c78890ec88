// SPDX-License-Identifier: Apache-2.0
// Error of the independent image, by a pilot estimate: Yang & Moon 2025, Eq. (11).
#pragma once

#include "filters/planes.h"

namespace covary {

/// (cross-bilateral mean of h over the window - h)^2 per channel, weights
///   w_j = exp(-||g_j - g_i||^2 / variance of g_i),   norm over RGB, variance summed over RGB.
/// `g`: moments of the CRN image with kFar outside; `h`: moments of the independent image with 0 outside. The result
/// has a border of `border` pixels set to kUseless. Bandwidth 0 (all CRN groups equal) gives weight 1 to pixels with
/// exactly the same value, 0 to others.
///
/// If pixels of the independent image have unequal counts n_j, weights are n_j w_j.
///
/// `slope`: optional, 3 planes without border that receive half the derivative of the result by the pixel's own h,
/// (1 - w) (h - mean), where w is its fraction of the weights.
Planes pilot_error(const Moments& g, const Moments& h, int window, int border, Planes* slope = nullptr);

}  // namespace covary
