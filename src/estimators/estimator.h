// SPDX-License-Identifier: Apache-2.0
// An estimator with its options, as everything else sees it: what it needs of a render, what it can do, and how.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/spectrum.h"
#include "estimators/estimator_result.h"
#include "estimators/sample_counts.h"
#include "film/grouped_image.h"

namespace covary {

/// The passes that an estimator makes its image of.
enum class EstimatorPasses {
  kPair,     ///< one with common random numbers and one with independent ones: Estimator::apply
  kSamples,  ///< an independent one, whose pixels are made of all their samples: Estimator::estimate_pixel
  /// An independent one, in groups: Estimator::apply, whose first image is empty.
  kIndependent,
  kAny,  ///< one of either kind, whose mean is the image: the film needs no estimator
};

/// What the surfaces behind the pixels look like: images of three channels, of the same size as the image. Null where
/// not known; there is no normal without an albedo.
struct Guides {
  const Image* albedo = nullptr;  ///< reflectance, in [0, 1]
  const Image* normal = nullptr;  ///< in [-1, 1]
  /// The same of what is seen in mirrors and through glass, in their colour; null: as above.
  const Image* denoising_albedo = nullptr;
  const Image* denoising_normal = nullptr;
  const Image* position = nullptr;  ///< of the first surface, in any unit
  bool clean = false;  ///< have little noise, so that a network need not denoise them first
};

/// A part of the samples' light, such as that which comes straight from lights.
struct Layer {
  std::string name;
  GroupedImage image;  ///< that part of each group of the independent image
};

/// What an estimator of a pair is told beside the images.
struct PairSettings {
  int64_t crn_samples = 1;  ///< samples per pixel of the CRN image, > 0; read where needs_sample_count says so
  bool std_error = false;   ///< estimate the standard error, too; where predicts_error says that it can
  bool held_out = true;     ///< with the standard error, also EstimatorResult::held_out
  Guides guides;            ///< read where reads_guides says so
  /// Layers that together are the independent image; read where splits_layers says so.
  std::span<const Layer> layers;
};

/// Samples of a pixel, and of each the first random numbers that it was made of: [sample][dimension].
using PixelFunction = std::function<Spectrum(std::span<const Spectrum> values, std::span<const float> coordinates)>;

/// Memory that an estimator takes beside its input, in bytes per pixel, about.
struct EstimatorMemory {
  double always = 0;
  /// In bytes: no more than this and its result, of estimators that work on parts of large images one after the other.
  double largest_part = std::numeric_limits<double>::infinity();
  /// More where both images have so many groups that halves of them are held out: at once, and for each group.
  double of_halves = 0, of_halves_per_group = 0;
  int groups_for_halves = 0;

  /// Bytes for an image of `n_pixels` pixels with `groups` groups.
  double bytes(double n_pixels, int groups) const {
    constexpr double kResult = 3 * sizeof(float);
    const double halves = groups >= groups_for_halves ? of_halves + of_halves_per_group * groups : 0;
    return std::min(n_pixels * always, largest_part + n_pixels * kResult) + n_pixels * halves;
  }
};

struct Estimator {
  EstimatorPasses passes = EstimatorPasses::kPair;
  std::string name;     ///< registered one
  std::string summary;  ///< a few words, for lists
  std::string text;     ///< name and options as given: "iicv --paper --k 50"

  std::string network;  ///< name and version of the neural network that takes part; empty where none does

  bool predicts_error = false;  ///< that of its result
  /// Its predicted error is to be calibrated by held-out samples (held_out_error.h).
  bool holds_out = false;
  /// Samples per pixel, of all passes together, below which the predicted error was measured to be unreliable.
  uint32_t reliable_samples = 0;
  bool needs_sample_count = false;  ///< PairSettings::crn_samples
  /// Groups of samples that it needs in each pass. All estimators take groups that differ in size by a sample.
  int fewest_groups = 1;
  bool reads_guides = false;   ///< PairSettings::guides
  bool splits_layers = false;  ///< PairSettings::layers
  /// Parts of the samples for the CRN and the independent pass where nothing else is asked for; they add up to 1.
  std::array<double, 2> split = {0.5, 0.5};

  std::optional<AdaptiveSampling> adaptive;  ///< not of estimators of the samples of a pixel

  // Of a pair, and of an independent pass in groups.
  std::function<EstimatorResult(const GroupedImage& crn, const GroupedImage& independent, const PairSettings& settings)>
      apply;
  int reach = 0;           ///< rows beyond its own that a band of rows needs; -1: the whole image is needed
  EstimatorMemory memory;  ///< that `apply` takes
  /// The control variates of a pixel; empty function where the estimator has none.
  std::function<std::vector<ControlVariate>(const GroupedImage& crn, const GroupedImage& independent, int x, int y)>
      explain;

  /// Images of single steps by name, for files; empty function where the estimator has none.
  std::function<std::map<std::string, Image>(const GroupedImage& crn, const GroupedImage& independent,
                                             const PairSettings& settings)>
      stages;

  // Of the samples of a pixel.
  PixelFunction estimate_pixel;
  int dimensions = 0;  ///< random numbers of each sample that estimate_pixel() reads
  /// Name and all options that change its pixels, for the film's settings: "polynomials dimensions=4".
  std::string film_settings;
  /// What is wrong with so many samples per pixel; empty if nothing is.
  std::function<std::vector<std::string>(uint32_t samples)> check_samples;
};

/// Estimator::explain for an estimator of grouped images whose options have a probe.
template <typename Function, typename Options>
auto explain_by_probe(Function function, const Options& options) {
  return [function, options](const GroupedImage& crn, const GroupedImage& independent, int x, int y) {
    PixelProbe probe{x, y, {}};
    Options probing = options;
    probing.probe = &probe;
    function(crn, independent, probing);
    return probe.control_variates;
  };
}

}  // namespace covary
