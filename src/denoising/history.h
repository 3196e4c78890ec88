// SPDX-License-Identifier: Apache-2.0
// What frames before show of the same scene, mixed into a frame where held-out samples find that better (ours).
//
// M: the mixture of the frame alone, with the standard error s; H: the history, moved to where it is seen now, of
// samples that are independent of the frame's. The candidate is
//
//     C = M + clamp(H - M, -k s, k s) / (1 + c e / s'^2),   e: squared error of H for being moved by parts of pixels,
//                                                           s'^2: mean of s^2 over the channels,
//
// so that history never leaves the interval in which the frame itself may be: what has changed (moving shadows, lamps
// that are dimmed) leaves no trail, and edges are not blurred by being moved time and again. With halves M_A and M_B in
// the place of M the same is made of each half, and mix() of mixture.h weights it as it does denoised images.
//
// Clamping to the values of the frame is usual in temporal antialiasing [Karis2014]; to a confidence interval and with
// measured weights is ours. That the image before is a control variate for re-rendering is in [Rousselle2016].
#pragma once

#include <array>
#include <vector>

#include "denoising/mixture.h"

namespace covary {

/// A picture of the frames before, by the pixels of this one.
struct History {
  Image image;                       ///< 3 channels
  Image squared_error;               ///< 1 channel: e
  std::vector<unsigned char> known;  ///< 0: nothing is known there
};

struct HistoryInput {
  std::array<const Moments*, 2> independent = {};     ///< as in MixtureInput
  const Image* std_error = nullptr;                   ///< of the mixture
  const Image* guide = nullptr;                       ///< as in MixtureInput
  const std::vector<unsigned char>* valid = nullptr;  ///< as there
  std::array<const Image*, 2> counts = {};            ///< as there
};

/// Adds the history to the frame's mixture and to its halves. The weights of `frame` become what is left to it;
/// returned are those of the history, one channel. Bit-identical for any number of threads. Throws Error(kInput) where
/// sizes differ.
Image add_history(const History& history, const HistoryInput& input, Mixture& frame);

}  // namespace covary
