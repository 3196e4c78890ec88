// SPDX-License-Identifier: Apache-2.0
// Candidates for mixture.h: images with less noise and more bias than the one they are made of.
//
// Without a neural network, the candidates come from NL-means (nl_means.h), whose weights use the estimator's image,
// its standard error, and albedo and normal as features: that image at two bandwidths; the independent image with the
// same weights; and the image divided by albedo, filtered with the normal as its only feature, and multiplied by albedo
// again. For a mean, a regression on albedo, normal and position can replace the first two. Open Image Denoise uses
// prefiltered features. For a pair, it denoises the independent image only: errors of the other are correlated between
// pixels, which the network was not trained on.
//
// If the image itself is the mean of the independent samples, no candidates are made from the independent image, and
// residual correction is added to Open Image Denoise's images (ResidualOptions in residual_correction.h). The
// network's image of all samples is then averaged with those of the halves (mirrored_halves.h).
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "denoising/denoise.h"
#include "estimators/method.h"
#include "filters/nl_means.h"
#include "filters/planes.h"
#include "filters/regression.h"
#include "filters/residual_correction.h"
#include "filters/wanted_rows.h"

namespace covary {

/// The images of one set of samples, from which candidates are made. All values are finite.
struct CandidateInput {
  const Image* estimate = nullptr;
  const Image* std_error = nullptr;    ///< of the estimate
  const Image* independent = nullptr;  ///< mean of the independent image
  const Moments* moments = nullptr;    ///< of the independent image
  const std::vector<unsigned char>* valid = nullptr;
  int part = 0;  ///< all samples; 1, 2: the halves
};

struct CandidateSet;  // mixture.h

/// Makes the same kinds of candidates from any set of samples.
struct CandidateMaker {
  /// The candidates of each set of samples: all samples, both halves, or all of these. All sets have the same valid
  /// pixels.
  using Make = std::function<std::vector<std::vector<Image>>(std::span<const CandidateInput>)>;

  std::vector<std::string> names;  ///< of the candidates, in order
  Make make;
  /// The layers of one set of samples (MethodSettings::layers, means without fireflies): for each candidate, the images
  /// of all layers. A filter's layers add up to the candidate, a network's only approximately. For
  /// CandidateBase::kMean.
  std::function<std::vector<std::vector<Image>>(const CandidateInput&, std::span<const Image> layers)> make_layers;
  /// Typical ratio of the squared error of a mixture of these candidates to the variance of its halves: the more noise
  /// candidates remove, the more of the error is bias. Measured (docs/methods/error-estimates.md).
  double error_over_variance = 0.65;
  bool network = false;       ///< uses a neural network
  std::function<int()> runs;  ///< number of network runs so far; empty without a network
  /// Index of the candidate to show if there are too few samples to compare candidates.
  int best_of_few = 0;
  /// In place of `make`: the shares in this candidate of the image and of the candidates before it.
  std::function<Planes(const CandidateInput&, const CandidateSet&)> shares;
};

/// Makes the candidates of each set of samples on its own.
CandidateMaker::Make one_by_one(std::function<std::vector<Image>(const CandidateInput&)> make);

/// The image to denoise: that of a two-pass estimator, or the mean of independent samples.
enum class CandidateBase { kPair, kMean };

/// NL-means of the image and of the image over its albedo; for a mean with albedo, regression.h in place of the former,
/// or all three. The regression gains next to nothing if a network's candidates are mixed in too.
enum class FilterKinds { kNlMeans, kRegression, kAll };
/// Those of the default, for a mean.
inline FilterKinds kinds_of_mean(bool with_network) { return with_network ? FilterKinds::kNlMeans : FilterKinds::kAll; }
/// Scales of differences of albedos and normals, and bandwidths of the sharp and the smooth filter.
inline constexpr float kAlbedoUnit = 0.07f, kNormalUnit = 0.2f, kSharpBandwidth = 0.5f, kSmoothBandwidth = 1;
/// What the regression fits the image to; nothing if it is not used, or if there is no albedo.
struct RegressionFeatures {
  std::vector<const Image*> features;
  const Image* position = nullptr;  ///< or null
  bool nl_means = true;             ///< whether NL-means filters the image itself, too
};
RegressionFeatures regression_features(const Features& features, FilterKinds kinds);
/// The feature of the image divided by albedo: the normal, if there is one, but for pixels that reflect nothing, such
/// as lamps. Divided by their albedo, they would outshine the surfaces beside them, so they are compared with each
/// other alone.
Image feature_of_light(const Features& features);
/// The names of filtered_candidates(), in order.
std::vector<std::string> filter_names(const Features& features, CandidateBase base, FilterKinds kinds);
/// Candidates without a network. The features must outlive the result. Rows of a larger image begin at a multiple of
/// kRegressionCell; kCandidateHalo rows from those that are missing, the bits are those of the whole.
CandidateMaker filtered_candidates(const Features& features, CandidateBase base = CandidateBase::kPair,
                                   FilterKinds kinds = FilterKinds::kNlMeans, const WantedRows& wanted = {});
/// Throws Error(kInput) for auxiliary images that cannot be used: of another size than the image, a normal alone,
/// values that are not finite (check_feature() of denoise.h).
void check_features(const Features& features, int width, int height);
/// The features for a neural network: those seen in mirrors and through glass, if available.
Features network_features(const Features& features);

/// Residual correction of a network's image in two widths.
inline constexpr std::array<ResidualOptions, 2> kNetworkResiduals = {{{0.5f, 61, 4}, {0.3f, 41, 2}}};

/// The images of a neural network: of all samples, averaged with those of the halves, and of both halves.
struct NetworkImages {
  std::array<Image, 3> images;
  int runs = 0;  ///< of the network
};
/// Layers that a neural network denoised.
struct NetworkLayers {
  std::vector<Image> images;
  int runs = 0;  ///< of the network so far
};
/// A neural network with its features, for images that are made elsewhere. The features must outlive it. Throws like
/// denoise(). `images`: as network_images(); `layers`: denoises each on its own.
struct NetworkCalls {
  std::function<NetworkImages(std::array<Image, 3>)> images;
  std::function<NetworkLayers(std::vector<Image>)> layers;
};
NetworkCalls network_calls(const Features& features, const DenoiseOptions& options);
/// `images`: what is denoised, of all samples and of both halves, or all samples alone with empty images of the halves.
/// Throws like denoise().
NetworkImages network_images(const Features& features, const DenoiseOptions& options, std::array<Image, 3> images);

/// Images denoised by a neural network. `made`: its images, if they are made already; otherwise they are made, which
/// takes all samples alone or with both halves, and throws like denoise().
CandidateMaker neural_candidates(const Features& features, const DenoiseOptions& options,
                                 CandidateBase base = CandidateBase::kPair,
                                 std::shared_ptr<const NetworkImages> made = nullptr);

/// Radius of influence of the input, and of the network's images, on a pixel of any candidate, in rows.
inline constexpr int kCandidateHalo = 36;
/// The same without a network.
inline constexpr int kFiltersHalo = kRegressionHalo;
static_assert(kFiltersHalo >= kNlMeansHalo);

}  // namespace covary
