// SPDX-License-Identifier: Apache-2.0
// Images with less noise and more bias than the one they are made of: candidates for mixture.h.
//
// Without a neural network (nl_means.h, steered by the estimator's image and its standard error, guided by albedo and
// normal): that image with two bandwidths; the independent image with the same weights; and the image over the albedo,
// filtered with the normal as the only guide, times the albedo. With Open Image Denoise: images denoised with
// guides that were denoised before: of a pair the independent image alone, as the errors of the other, which pixels
// have in common, are not what the network was trained on.
//
// Where the image is the mean of the independent samples itself, the images of the one are left out, and those of Open
// Image Denoise come with what they took away from pixels alike given back (ResidualOptions of residual_correction.h).
// The network's image of all samples is a mean with those of the halves there (mirrored_halves.h).
#pragma once

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "denoising/denoise.h"
#include "estimators/estimator.h"
#include "filters/planes.h"

namespace covary {

/// What candidates are made of: the images of one set of samples. All values are finite.
struct CandidateInput {
  const Image* estimate = nullptr;
  const Image* std_error = nullptr;    ///< of the estimate
  const Image* independent = nullptr;  ///< mean of the independent image
  const Moments* moments = nullptr;    ///< of the independent image
  const std::vector<unsigned char>* valid = nullptr;
};

/// Makes candidates, the same of any samples.
struct CandidateMaker {
  /// The images of each of several sets of samples, all with the same valid pixels: all samples, or these and both
  /// halves of them.
  using Make = std::function<std::vector<std::vector<Image>>(std::span<const CandidateInput>)>;

  std::vector<std::string> names;  ///< of its images, in their order
  Make make;
  /// The same of the layers of one set of samples (PairSettings::layers, means without fireflies): for each candidate
  /// the images of all layers. Those of filters add up to the candidate's, those of a network about. For
  /// CandidateBase::kMean.
  std::function<std::vector<std::vector<Image>>(const CandidateInput&, std::span<const Image> layers)> make_layers;
  /// What the squared error of a mixture that has these usually is, over the variance of mixtures of half of the
  /// samples: the more of it they take away, the more of the error is bias. Measured (docs/methods/error-estimates.md).
  double error_over_variance = 0.65;
  bool network = false;       ///< a neural network makes them
  std::function<int()> runs;  ///< of the network, so far; none without one
  /// Number of the one to show where samples are too few to judge.
  int best_of_few = 0;
};

/// Candidates of one set of samples after the other.
CandidateMaker::Make one_by_one(std::function<std::vector<Image>(const CandidateInput&)> make);

/// Whose images: an estimator's of two passes, or the mean of independent samples.
enum class CandidateBase { kPair, kMean };

/// Filters without a network. The guides are copied.
CandidateMaker filtered_candidates(const Guides& guides, CandidateBase base = CandidateBase::kPair);
/// The guides of a neural network: those of what is seen in mirrors and through glass, where they are known.
Guides network_guides(const Guides& guides);
/// Images denoised by a neural network. Throws like denoise().
CandidateMaker neural_candidates(const Guides& guides, const DenoiseOptions& options,
                                 CandidateBase base = CandidateBase::kPair);

}  // namespace covary
