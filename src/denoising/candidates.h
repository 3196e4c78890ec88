// SPDX-License-Identifier: Apache-2.0
// Candidates for mixture.h: images with less noise and more bias than the one they are made of.
//
// Without a neural network, NL-means (nl_means.h) steered by the estimator's image and its standard error, with albedo
// and normal as guides, makes: that image with two bandwidths; the independent image with the same weights; and the
// image divided by the albedo, filtered with the normal as the only guide and multiplied by the albedo; of a mean,
// regression over albedo, normal and position in place of the first two. Open Image Denoise uses guides that were
// denoised first. Of a pair, it only denoises the independent image: the other's errors are shared between pixels,
// which the network was not trained on.
//
// Where the image itself is the mean of the independent samples, the candidates made from the independent image are
// left out, and Open Image Denoise's images get residual correction (ResidualOptions in residual_correction.h). The
// network's image of all samples is then averaged with those of the halves (mirrored_halves.h).
#pragma once

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "denoising/denoise.h"
#include "estimators/estimator.h"
#include "filters/planes.h"

namespace covary {

/// The inputs of candidates: the images of one set of samples. All values are finite.
struct CandidateInput {
  const Image* estimate = nullptr;
  const Image* std_error = nullptr;    ///< of the estimate
  const Image* independent = nullptr;  ///< mean of the independent image
  const Moments* moments = nullptr;    ///< of the independent image
  const std::vector<unsigned char>* valid = nullptr;
};

/// Makes candidates; the same kinds for any samples.
struct CandidateMaker {
  /// The candidates of each set of samples; all sets have the same valid pixels: all samples alone, or these and both
  /// halves.
  using Make = std::function<std::vector<std::vector<Image>>(std::span<const CandidateInput>)>;

  std::vector<std::string> names;  ///< of its images, in their order
  Make make;
  /// The layers of one set of samples (PairSettings::layers, means without fireflies): for each candidate, the images
  /// of all layers. A filter's layers add up to the candidate, a network's only approximately. For
  /// CandidateBase::kMean.
  std::function<std::vector<std::vector<Image>>(const CandidateInput&, std::span<const Image> layers)> make_layers;
  /// Typical squared error of a mixture of these candidates over the variance of mixtures of half of the samples: the
  /// more noise candidates remove, the more of the error is bias. Measured (docs/methods/error-estimates.md).
  double error_over_variance = 0.65;
  bool network = false;       ///< a neural network makes them
  std::function<int()> runs;  ///< runs of the network so far; none without one
  /// Index of the candidate to show where there are too few samples to judge.
  int best_of_few = 0;
};

/// The candidates of several makers, one after the other.
CandidateMaker::Make one_by_one(std::function<std::vector<Image>(const CandidateInput&)> make);

/// Which image is denoised: that of a two-pass estimator, or the mean of independent samples.
enum class CandidateBase { kPair, kMean };

/// NL-means of the image and of the image over its albedo; of a mean with an albedo, regression.h in place of the
/// former, or all three. Beside a network's images the regression gains next to nothing.
enum class FilterKinds { kNlMeans, kRegression, kAll };
/// Filters without a network. Copies the guides.
CandidateMaker filtered_candidates(const Guides& guides, CandidateBase base = CandidateBase::kPair,
                                   FilterKinds kinds = FilterKinds::kNlMeans);
/// Guides of a neural network: those seen in mirrors and through glass, where available.
Guides network_guides(const Guides& guides);
/// Images denoised by a neural network. Throws like denoise().
CandidateMaker neural_candidates(const Guides& guides, const DenoiseOptions& options,
                                 CandidateBase base = CandidateBase::kPair);

}  // namespace covary
