// SPDX-License-Identifier: Apache-2.0
// What frames before show of the same scene, mixed into a frame where held-out samples find that better (ours).
//
// M: the mixture of the frame alone, with the standard error s; s*: M times the median of s / M of 5 x 5 pixels; H: the
// history, moved to where it is seen now, of samples that are independent of the frame's. The candidate is
//
//     C = M + clamp(H - M, -k s*, k s*) / (1 + e / s'^2),     e: squared error of H for being moved by parts of pixels,
//                                                             s'^2: mean of s^2 over the channels,
//
// so that history never leaves the interval in which the frame itself may be: what has changed (moving shadows, lamps
// that are dimmed) leaves no trail, and edges are not blurred by being moved time and again. With halves M_A and M_B in
// the place of M the same is made of each half, and mix() of mixture.h weights it as it does denoised images.
//
// Before, H and R are multiplied by what the frame's samples find that light has changed by, over pixels that look
// alike: 1 + max(0, 1 - v / d^2) d / r with the difference d of sums, its variance v, and the sum r of the history
// [JamesStein1961].
//
// Clamping to the values of the frame is usual in temporal antialiasing [Karis2014]; to a confidence interval and with
// measured weights is ours. That the image before is a control variate for re-rendering is in [Rousselle2016].
//
// Where the samples of frames before are kept, they are denoised once more. With means of both halves of them, R_A and
// R_B, and of the frame's own, Y_A and Y_B,
//
//     R'_h = Y_h + b t (R_h - Y_h),   t = 0.9 / (1 + e / s'^2),     b by mix(): Y_B judges R_A, and Y_A judges R_B.
//
// So b follows from the variances of both and from what has changed, and R'_A and R'_B are independent of each other.
// The frame's denoiser makes a mixture D of them as it does of its own samples. D is a second candidate beside C, in
// M +- k max(s, s*), so that a firefly of one frame does not stay in the next ones; the frame's own samples judge both.
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
  std::array<Image, 2> samples;      ///< R_A and R_B, 3 channels; empty where they were not kept
  /// Albedo and normal as the frame before had them there, and what the picture changes by with them: of feature i and
  /// channel c at 3 i + c. Empty where they were not kept.
  Image features, slopes;
};

/// Adds to a history what this frame's features differ by from those that were moved, times the slopes: at edges and in
/// textures, pixels show other parts of the same surfaces than before, and features tell which. At most a fifth of the
/// colour, because slopes of blurred pictures of very bright light are too large; squared_error grows by the square of
/// the whole difference. Nothing without features. Both have 3 channels. Throws Error(kInput) where sizes differ.
void follow_features(History& history, const Image& albedo, const Image& normal);

/// Layers of a frame's file with R'_A, R'_B, albedo and normal: EstimatorResult::kept_samples.
inline constexpr std::array<const char*, 4> kKeptSamples = {"HistoryA", "HistoryB", "HistoryAlbedo", "HistoryNormal"};

struct HistoryInput {
  std::array<const Moments*, 2> independent = {};     ///< as in MixtureInput
  const Image* std_error = nullptr;                   ///< of the mixture
  const Image* guide = nullptr;                       ///< as in MixtureInput
  const std::vector<unsigned char>* valid = nullptr;  ///< as there
  std::array<const Image*, 2> counts = {};            ///< as there
  const Image* common_counts = nullptr;               ///< counts_of()
};

/// What squared errors of samples count: 1 / (F'^2 + 0.01) by the mean F of the frame's mixture and the history. By a
/// picture made of the frame's samples alone, pixels that are bright by chance would count less, and with them what
/// the history takes away. Throws Error(kInput) where sizes differ.
Image counts_of(const History& history, const Image& guide);

/// Adds History::samples to the frame's own: from Y, Y_A and Y_B to the mean of R'_A and R'_B and these. Bit-identical
/// for any number of threads.
void add_samples(const History& history, const HistoryInput& input, Image& mean, std::array<Image, 2>& halves);

/// Adds the history to the frame's mixture and to its halves; `accumulated`: D and its halves, or null. The weights of
/// `frame` become what is left to it; returned are those of C and D together, one channel. Bit-identical for any number
/// of threads.
Image add_history(const History& history, const HistoryInput& input, const Mixture* accumulated, Mixture& frame);

}  // namespace covary
