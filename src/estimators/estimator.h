// SPDX-License-Identifier: Apache-2.0
// An estimator with its options, as seen by everything else: its requirements, its capabilities, and its functions.
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

/// The render passes that an estimator consumes.
enum class EstimatorPasses {
  kPair,     ///< a CRN pass and an independent pass: Estimator::apply
  kSamples,  ///< an independent pass, each pixel computed from all its samples: Estimator::estimate_pixel
  /// An independent pass, in groups: Estimator::apply, whose first image is empty.
  kIndependent,
  kAny,  ///< a pass of either kind whose mean is the image: the film needs no estimator
};

/// Auxiliary images of the surfaces behind the pixels: three channels, of the image's size. Null if unknown; a normal
/// is given only together with an albedo.
struct Guides {
  const Image* albedo = nullptr;  ///< reflectance, in [0, 1]
  const Image* normal = nullptr;  ///< in [-1, 1]
  /// Same, but of what is seen through mirrors and glass, tinted by them; null: use those above.
  const Image* denoising_albedo = nullptr;
  const Image* denoising_normal = nullptr;
  const Image* position = nullptr;  ///< of the first surface, in any unit
  bool clean = false;               ///< nearly noise-free, so that a network need not prefilter them
};

/// A component of the image, such as direct light.
struct Layer {
  std::string name;
  GroupedImage image;                ///< that component of each group of the independent image
  int sum = 0;                       ///< layers of the same number add up to the image
  static constexpr int kNoSum = -1;  ///< not a part of the image, such as alpha
};

/// Settings of an estimator of a pair, beside the images.
struct PairSettings {
  int64_t crn_samples = 1;  ///< samples per pixel of the CRN image, > 0; used if needs_sample_count
  bool std_error = false;   ///< also estimate the standard error; used if predicts_error
  bool held_out = true;     ///< together with the standard error, also compute EstimatorResult::held_out
  Guides guides;            ///< used if reads_guides
  /// Layers that sum to the independent image, and others; used if splits_layers.
  std::span<const Layer> layers;
};

/// A pair of images, or an independent one alone, of which only some rows are in memory at a time.
struct PairInRows {
  struct Rows {
    GroupedImage crn, independent;  ///< the first is empty if there is none
  };
  int width = 0, height = 0;
  int rows_at_once = 0;
  /// Rows first … first + n - 1. The referenced memory is valid until the next call.
  std::function<Rows(int first, int n)> rows;
};

/// Estimates a pixel from its samples and, for each, the first random numbers it was made from: [sample][dimension].
using PixelFunction = std::function<Spectrum(std::span<const Spectrum> values, std::span<const float> coordinates)>;

/// Approximate memory of an estimator beyond its input, in bytes per pixel.
struct EstimatorMemory {
  double always = 0;
  /// In bytes: upper limit, beside the result, for estimators that process large images in parts.
  double largest_part = std::numeric_limits<double>::infinity();
  /// Additional memory if both images have enough groups to hold out halves: fixed, and per group.
  double of_halves = 0, of_halves_per_group = 0;
  int groups_for_halves = 0;
  /// Of `apply_in_rows`, per pixel of the whole image, beside the result.
  double of_whole = 0;

  /// Bytes for an image of `n_pixels` pixels with `groups` groups.
  double bytes(double n_pixels, int groups) const {
    constexpr double kResult = 3 * sizeof(float);
    const double halves = groups >= groups_for_halves ? of_halves + of_halves_per_group * groups : 0;
    return std::min(n_pixels * always, largest_part + n_pixels * kResult) + n_pixels * halves;
  }
};

struct Estimator {
  EstimatorPasses passes = EstimatorPasses::kPair;
  std::string name;     ///< as registered
  std::string summary;  ///< a few words, for lists
  std::string text;     ///< name and options as given: "iicv --paper --k 50"

  std::string network;  ///< name and version of the neural network it uses; empty if none

  bool predicts_error = false;  ///< whether it predicts the error of its result
  /// Whether its predicted error should be calibrated by held-out samples (held_out_error.h).
  bool holds_out = false;
  /// Samples per pixel, over all passes, below which the predicted error was found to be unreliable.
  uint32_t reliable_samples = 0;
  bool needs_sample_count = false;  ///< whether it uses PairSettings::crn_samples
  /// Minimum number of groups in each pass. All estimators accept groups whose sizes differ by one sample.
  int fewest_groups = 1;
  bool reads_guides = false;   ///< whether it uses PairSettings::guides
  bool splits_layers = false;  ///< whether it uses PairSettings::layers
  /// Default fractions of the samples for the CRN and the independent pass; they sum to 1.
  std::array<double, 2> split = {0.5, 0.5};

  std::optional<AdaptiveSampling> adaptive;  ///< never set for kSamples estimators

  // For pairs, and for independent passes in groups.
  std::function<EstimatorResult(const GroupedImage& crn, const GroupedImage& independent, const PairSettings& settings)>
      apply;
  int reach = 0;  ///< extra rows on each side that a band of rows needs; -1: needs the whole image
  /// The result of `apply` for the whole image, with the same bits, for estimators whose bands share more than pixels;
  /// otherwise empty. Without layers; guides are those of the whole image.
  std::function<EstimatorResult(const PairInRows& image, const PairSettings& settings)> apply_in_rows;
  EstimatorMemory memory;  ///< memory of `apply`
  /// The control variates of a pixel; an empty function if the estimator has none.
  std::function<std::vector<ControlVariate>(const GroupedImage& crn, const GroupedImage& independent, int x, int y)>
      explain;

  /// Images of intermediate steps by name, for output; an empty function if the estimator has none.
  std::function<std::map<std::string, Image>(const GroupedImage& crn, const GroupedImage& independent,
                                             const PairSettings& settings)>
      stages;

  // For kSamples estimators.
  PixelFunction estimate_pixel;
  int dimensions = 0;  ///< random numbers per sample that estimate_pixel() reads
  /// Name and all options that change its pixels, for the film's settings: "polynomials dimensions=4".
  std::string film_settings;
  /// Problems with this number of samples per pixel; empty if there are none.
  std::function<std::vector<std::string>(uint32_t samples)> check_samples;

  /// The film of a single pass holds the image.
  bool image_is_film() const { return passes == EstimatorPasses::kAny || passes == EstimatorPasses::kSamples; }
};

/// Estimator::explain for an estimator of grouped images whose options include a probe.
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
