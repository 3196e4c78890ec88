// SPDX-License-Identifier: Apache-2.0
// A look into image-space control variates: what one pixel was made of.
#pragma once

#include <vector>

namespace covary {

/// One control variate of a pixel: where it is, and its coefficient beta_i of [YM2025] Eq. (7).
struct ControlVariate {
  int dx = 0, dy = 0;  ///< from the target
  float beta[3] = {};  ///< per channel; equal where coefficients are shared
};

/// Asks for the control variates of one pixel, and holds the answer: nearest places first, without places
/// outside the frame; empty where the pixel is not valid.
struct PixelProbe {
  int x = 0, y = 0;
  std::vector<ControlVariate> control_variates;
};

}  // namespace covary
