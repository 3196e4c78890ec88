// SPDX-License-Identifier: Apache-2.0
// Mixtures of images by cross-validation: held-out samples, which no image was made of, determine each pixel's weights.
// Weights of denoisers with x >= 0, sum x <= 1 from two half buffers are Ensemble Denoising [Zheng2021]; filters chosen
// by half buffers go back to [RKZ2011], [RKZ2012], regressions stacked by cross-validation to [Breiman1996]. Here F,
// with little bias, is one of the images, and the weights are shrunk.
//
// F: an image with little bias, C_p: candidates with less noise and more bias. From one half of the samples, A, the
// same methods make F_A and C_A,p; the independent image h_B of the other half is unbiased, with errors independent of
// theirs. So with U_p = C_p - F, the mean over both directions of
//
//     ||h_B - F_A - sum_p x_p U_A,p||^2 / (F'_A^2 + 0.01),   F'_A: mean of the pixel's channels,
//
// is the squared error of the half's mixture, up to a constant. Its coefficients are summed over a window with
// cross-bilateral weights w_ij = exp(-||G_j - G_i||^2 / ((0.5 G'_i)^2 + 1e-4)) of a guide G, by cells of 4 x 4 pixels.
//
// The variance of the half's mixture follows from both halves, ||M_A - M_B||^2 / 2; the rest is squared bias. The
// weights x minimise
//
//     bias_share * squared bias + variance,   x >= 0, sum x <= 1.
//
// Where these sums are mostly noise, weights are shrunk towards x0, those of the whole image: prior * v ||x - x0||^2 is
// added, with v the mean variance of the U_p, which vanishes with more samples. x0 in turn is shrunk towards typical
// weights x1 by typical_count * v ||x0 - x1||^2, summed over the whole image, because halves of few samples overrate
// smooth images. Of large images, x0 is that of a sample of rows (in_sample()).
//
// The mixture of all samples has half that variance, which suggests bias_share = 2; but its bias is also smaller than
// that of a half, and 1 gives less error (docs/notes/denoising.md).
#pragma once

#include <array>
#include <vector>

#include "filters/mixture_weights.h"
#include "filters/planes.h"

namespace covary {

/// An image and the candidates made from the same samples.
struct CandidateSet {
  Image base;                     ///< F
  std::vector<Image> candidates;  ///< C_p
  /// If there are any, the last candidate consists of the others with these shares (weighing/weighing.h).
  Planes shares = {};
  size_t n_made() const { return candidates.size() - (shares.count() > 0 ? 1 : 0); }  ///< without that one
};

struct MixtureInput {
  const CandidateSet* whole = nullptr;
  std::array<const CandidateSet*, 2> halves = {};
  std::array<const Moments*, 2> independent = {};  ///< of the halves' independent images
  const Image* guide = nullptr;
  const std::vector<unsigned char>* valid = nullptr;  ///< pixels with 0 are left out and keep the base image
  float bias_share = 1;                               ///< weight of the squared bias, > 0
  float prior = 0;                                    ///< weight of the prior towards the whole image's weights, >= 0
  /// x1: typical weights of the candidates, >= 0, with a sum of at most 1; empty: none are known.
  std::vector<float> typical;
  float typical_count = 0;  ///< weight of the prior towards these, >= 0
  /// Weights of each half's squared errors per pixel, one channel, made of the same half; null: 1 / (F'_A^2 + 0.01).
  std::array<const Image*, 2> counts = {};
  /// x0, if these are rows of a larger image; empty: of the rows of this image in the sample.
  std::vector<float> everywhere;
};

/// The normal equations of a row, summed over its pixels.
using NormalRow = std::array<float, n_normal_sums(kMaxCandidates)>;
/// Those of rows first … end - 1. The input needs no image of all samples.
std::vector<NormalRow> normal_rows(const MixtureInput& input, int first, int end);
/// x0 from the sample's rows, with the input's prior towards `typical`; `m`: number of candidates.
std::vector<float> weights_everywhere(const MixtureInput& input, int m, const std::vector<NormalRow>& rows);

/// Rows first … end - 1 of an image.
struct SampledRows {
  int first = 0, end = 0;
};
/// The rows that determine x0: all, or of an image of more than kMaxSampledPixels pixels, evenly distributed blocks:
/// kSampledBlocks, or two if these had fewer than kMinBlockRows rows each, since a band makes rows around each block.
std::vector<SampledRows> sampled_rows(int width, int height);
inline constexpr double kMaxSampledPixels = 1 << 21, kMinBlockRows = 96;
inline constexpr int kSampledBlocks = 4;

struct Mixture {
  Image image;
  std::array<Image, 2> halves;  ///< the halves' images, mixed with the same weights
  std::vector<Image> weights;   ///< x_p, one channel each; the base image has the remainder up to 1
};

/// How much the candidates differ from an image, 1 channel: squared differences over the guide's G'^2 + 0.01, averaged
/// over channels and the surrounding 5 x 5 pixels, then their geometric mean over the candidates, because a single bad
/// one says little. Each counts as at least 1/30 of their arithmetic mean, so that a candidate equal to the image does
/// not hide the others.
Image disagreement(const CandidateSet& set, const Image& guide, const Image& image,
                   const std::vector<unsigned char>& valid);

/// The mixture of 1 to kMaxCandidates candidates. Bit-identical for any number of threads.
Mixture mix(const MixtureInput& input);

}  // namespace covary
