// SPDX-License-Identifier: Apache-2.0
// Mixtures of images by cross-validation (ours): samples that the images were not made of decide which images are best
// at a pixel, and in which proportions.
//
// F: an image with little bias, C_p: candidates with less noise and more bias. From one half of the samples, A, the
// same methods make F_A and C_A,p; the independent image h_B of the other half has the right expectation and errors
// independent of theirs. So with U_p = C_p - F, the mean over both directions of
//
//     ||h_B - F_A - sum_p x_p U_A,p||^2 / (F'_A^2 + 0.01),   F'_A: mean of the pixel's channels,
//
// is the squared error of the half's mixture, up to a constant. Its coefficients are summed over a window of pixels
// like the target, w_ij = exp(-||G_j - G_i||^2 / ((0.5 G'_i)^2 + 1e-4)) with a guide G, over cells of 4 x 4 pixels.
//
// The variance of the half's mixture follows from both halves, ||M_A - M_B||^2 / 2; the rest is squared bias. The
// weights x minimise
//
//     bias_share * squared bias + variance,   x >= 0, sum x <= 1.
//
// Where these sums are mostly noise, weights are shrunk towards those of the whole image, x0: prior * v ||x - x0||^2 is
// added, with v the mean variance of the U_p. It vanishes with more samples. x0 in turn is shrunk towards typical
// weights x1 by usual_count * v ||x0 - x1||^2 of the whole image, because with few samples, halves overrate smooth
// images.
//
// The whole image has half of that variance. Its bias is also smaller than that of a half, so bias_share = 1 gives less
// error than 2 (docs/notes/denoising.md).
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
};

struct MixtureInput {
  const CandidateSet* whole = nullptr;
  std::array<const CandidateSet*, 2> halves = {};
  std::array<const Moments*, 2> independent = {};  ///< of the halves' independent images
  const Image* guide = nullptr;
  const std::vector<unsigned char>* valid = nullptr;  ///< pixels with 0 are left out and keep the base image
  float bias_share = 1;                               ///< weight of the squared bias, > 0
  float prior = 0;                                    ///< weight of the prior towards the whole image's weights, >= 0
  /// Typical weights of the candidates, >= 0, with a sum of at most 1; empty: none are known.
  std::vector<float> usual;
  float usual_count = 0;  ///< weight of the prior towards these, >= 0
  /// Weights of each half's squared errors per pixel, one channel, made of the same half; null: 1 / (F'_A^2 + 0.01).
  std::array<const Image*, 2> counts = {};
};

struct Mixture {
  Image image;
  std::array<Image, 2> halves;  ///< the halves' images, mixed with the same weights
  std::vector<Image> weights;   ///< x_p, one channel each; the remainder up to 1 is the base image's
};

/// Squared differences of the candidates from an image over the guide's G'^2 + 0.01, averaged over channels and the
/// surrounding 5 x 5 pixels, then their geometric mean over the candidates, because a single one that is wrong says
/// little. None counts as less than 1/30 of their mean, so that a candidate equal to the image does not hide the
/// others. One channel.
Image disagreement(const CandidateSet& set, const Image& guide, const Image& image,
                   const std::vector<unsigned char>& valid);

/// Bit-identical for any number of threads.
Mixture mix(const MixtureInput& input);

}  // namespace covary
