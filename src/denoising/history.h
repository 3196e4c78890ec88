// SPDX-License-Identifier: Apache-2.0
// Temporal accumulation: mixes previous frames into a frame where held-out samples show less error for it.
//
// M: the frame's own mixture, with standard error s; s*: M times the median of s / M over 5 x 5 pixels; H: the history,
// previous frames reprojected to this one, with samples independent of the frame's. The candidate is
//
//     C = M + clamp(H - M, -k s*, k s*) / (1 + e / s'^2),     e: squared error of H from resampling between pixels,
//                                                             s'^2: mean of s^2 over the channels,
//
// which stays within the confidence interval of the frame: changes (moving shadows, dimmed lamps) leave no trail, and
// repeated resampling does not blur edges. Halves M_A and M_B in place of M give the candidate of each half, and mix()
// of mixture.h weights it like a denoised image.
//
// First, H and R (below) are scaled by the change of the light that the frame's samples find, over pixels that look
// alike: 1 + max(0, 1 - v / d^2) d / r with the difference d of sums, its variance v, and the sum r of the history
// [JamesStein1961].
//
// Reprojected frames come from [Nehab2007], their accumulation before a filter from [Schied2017]. Temporal antialiasing
// clamps them to the range or the variance of the frame's neighbouring pixels [Karis2014], [Salvi2016], [Yang2020];
// here the frame's standard error sets the bounds, and held-out samples the weights. [Rousselle2016] uses the previous
// image as a control variate for re-rendering.
//
// If samples of previous frames are kept, they are denoised again with the new ones. With R_A and R_B, the means of
// their halves, and Y_A and Y_B, those of the frame's own,
//
//     R'_h = Y_h + b t (R_h - Y_h),   t = 0.9 / (1 + e / s'^2),     b by mix(): Y_B tests R_A, and Y_A tests R_B.
//
// So b follows from the variances of both and from what has changed, and R'_A and R'_B are independent of each other.
// The frame's denoiser makes a mixture D of them, as of its own samples. D is a second candidate beside C, clamped to
// M +- k max(s, s*), so that a firefly does not persist in later frames; the frame's own samples weight both.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "denoising/mixture.h"

namespace covary {

/// Attribute of a result with History::of.
inline constexpr const char* kHistoryAttribute = "covary:history";

/// Channels of albedo and normal together.
inline constexpr int kHistoryFeatures = 6;

/// The previous frames, reprojected to the pixels of this one.
struct History {
  Image image;                       ///< 3 channels
  Image squared_error;               ///< 1 channel: e
  std::vector<unsigned char> known;  ///< 0: the pixel has no history
  std::array<Image, 2> samples;      ///< R_A and R_B, 3 channels; empty if not kept
  /// Albedo and normal of the previous frame, reprojected, 6 channels; and the slopes of its image over them, 18
  /// channels: that of image channel c over feature i is at 3 i + c. Empty if not kept.
  Image features, slopes;
  std::string of;  ///< identifies the picture of the frame before; "": unknown
};

/// Adds slopes times the difference of this frame's features from the reprojected ones to a history: at edges and in
/// textures, pixels show other parts of the same surfaces than before, and features tell which. The change is clamped
/// to a fifth of the colour, because slopes near blurred, very bright light are too large; squared_error grows by the
/// square of the unclamped change. Does nothing without features. Both have 3 channels. Throws Error(kInput) if sizes
/// differ.
void follow_features(History& history, const Image& albedo, const Image& normal);

/// Layers of a frame's file with R'_A, R'_B, albedo and normal: EstimatorResult::kept_samples.
inline constexpr std::array<const char*, 4> kKeptSamples = {"HistoryA", "HistoryB", "HistoryAlbedo", "HistoryNormal"};

/// MixtureInput::prior
inline constexpr float kPriorOfHistory = 2;
/// MixtureInput::bias_share. Halves have twice the variance of the frame but the same history, whose error is all bias
/// to them: 2 would be right for the whole frame. But windows of few samples overrate that error
/// (docs/notes/sequences.md).
inline constexpr float kShareOfHistory = 1.4f;

struct HistoryInput {
  std::array<const Moments*, 2> independent = {};     ///< as in MixtureInput
  const Image* std_error = nullptr;                   ///< of the mixture
  const Image* guide = nullptr;                       ///< as in MixtureInput
  const std::vector<unsigned char>* valid = nullptr;  ///< as there
  std::array<const Image*, 2> counts = {};            ///< as there
  const Image* common_counts = nullptr;               ///< counts_of()
};

/// The weights of squared errors of samples, 1 / (F'^2 + 0.01), 1 channel. F is the mean of `guide` and the history: an
/// image of the frame's samples alone would give pixels that are bright by chance a low weight, just where history
/// removes most. Throws Error(kInput) if sizes differ.
Image counts_of(const History& history, const Image& guide);

/// Adds History::samples to the frame's own: `mean` and `halves` hold Y, Y_A and Y_B, and become R', R'_A and R'_B; for
/// R', R is the mean of R_A and R_B. Bit-identical for any number of threads.
void add_samples(const History& history, const HistoryInput& input, Image& mean, std::array<Image, 2>& halves);

/// Mixes the history into the frame's mixture and its halves; `accumulated`: D and its halves, or null. Returns the sum
/// of the weights of C and D, one channel, and scales the weights of `frame` by the remainder up to 1. Bit-identical
/// for any number of threads.
Image add_history(const History& history, const HistoryInput& input, const Mixture* accumulated, Mixture& frame);

}  // namespace covary
