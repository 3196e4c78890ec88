// SPDX-License-Identifier: Apache-2.0
// A method with its options, as seen by everything else: the passes it needs with the function that makes the image of
// them, and what it can do.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "core/spectrum.h"
#include "estimators/estimator_result.h"
#include "estimators/sample_counts.h"
#include "film/auxiliary_features.h"
#include "film/grouped_image.h"

namespace covary {

/// Differences between features of the first and of the second half of the samples. A float's upper 16 bits are enough
/// for them.
struct FeatureDifferences {
  std::array<std::vector<uint16_t>, feature::kCount> values;  ///< of each image; empty: it does not differ
  /// Of each image and half: times the difference, added to the feature of all samples, that of the half.
  std::array<std::array<float, 2>, feature::kCount> factors = {
      {{0.5f, -0.5f}, {0.5f, -0.5f}, {0.5f, -0.5f}, {0.5f, -0.5f}, {0.5f, -0.5f}}};
};
inline uint16_t upper_half(float value) {
  return static_cast<uint16_t>((std::bit_cast<uint32_t>(value) + 0x8000u) >> 16);
}
inline float from_upper_half(uint16_t half) { return std::bit_cast<float>(static_cast<uint32_t>(half) << 16); }

/// Auxiliary images of the surfaces behind the pixels: three channels, of the image's size. Null if unknown; a normal
/// is given only together with an albedo.
struct Features {
  const Image* albedo = nullptr;  ///< reflectance, in [0, 1]
  const Image* normal = nullptr;  ///< in [-1, 1]
  /// Same, but of what is seen through mirrors and glass, tinted by them; null: use those above.
  const Image* denoising_albedo = nullptr;
  const Image* denoising_normal = nullptr;
  const Image* position = nullptr;  ///< of the first surface, in any unit
  bool clean = false;               ///< nearly noise-free, so that a network need not prefilter them
  /// What the images of the halves of the samples, the first, third, … groups and the others, differ by; null: nothing
  /// (denoising/render_features.h).
  const FeatureDifferences* differences = nullptr;
};

/// The images of Features, in the order of kAuxiliaryFeatures.
inline constexpr std::array<const Image * Features::*, feature::kCount> kImagesOfFeatures = {
    &Features::albedo, &Features::normal, &Features::position, &Features::denoising_albedo,
    &Features::denoising_normal};

/// A component of the image, such as direct light.
struct Layer {
  std::string name;
  GroupedImage image;                ///< that component of each group of the independent image
  int sum = 0;                       ///< layers of the same number add up to the image
  static constexpr int kNoSum = -1;  ///< not a part of the image, such as alpha
};

/// What a method may read beside the samples.
struct MethodSettings {
  int64_t crn_samples = 1;  ///< samples per pixel of the CRN image, > 0; used if PassPair::needs_sample_count
  bool std_error = false;   ///< also estimate the standard error; used if Method::predicts_error
  bool held_out = true;     ///< with the standard error: also what held-out samples tell of it
  Features features;        ///< used if Method::reads_features
  /// Layers that sum to the independent image, and others; used if Method::splits_layers().
  std::span<const Layer> layers;
};

/// The samples that a method makes an image of.
struct Samples {
  GroupedImage crn;  ///< with common random numbers; empty, unless the method takes a pair
  GroupedImage independent;
};

/// Samples of which only some rows are in memory at a time.
struct SamplesInRows {
  int width = 0, height = 0;
  int rows_at_once = 0;
  /// Rows first … first + n - 1. The referenced memory is valid until the next call.
  std::function<Samples(int first, int n)> rows;
};

/// Approximate memory of a method beyond its input, in bytes per pixel.
struct MethodMemory {
  double always = 0;
  /// In bytes: upper limit, beside the result, for methods that process large images in parts.
  double largest_part = std::numeric_limits<double>::infinity();
  /// Additional memory if both images have enough groups to hold out halves: fixed, and per group.
  double of_halves = 0, of_halves_per_group = 0;
  int groups_for_halves = 0;
  /// Of `image_in_rows`, per pixel of the whole image, beside the result.
  double of_whole = 0;

  /// Bytes for an image of `n_pixels` pixels with `groups` groups.
  double bytes(double n_pixels, int groups) const {
    constexpr double kResult = 3 * sizeof(float);
    const double halves = groups >= groups_for_halves ? of_halves + of_halves_per_group * groups : 0;
    return std::min(n_pixels * always, largest_part + n_pixels * kResult) + n_pixels * halves;
  }
};

// The passes that a method may need, each with the function that makes the image.

/// An independent pass, in groups.
struct OnePass {
  std::function<MethodImage(const GroupedImage& independent, const MethodSettings& settings)> image;
  /// The image is the mean. Then the pass may have common random numbers, too, and its film holds the image.
  bool is_mean = false;
};

/// A pass with common random numbers (CRN) and an independent one, in groups.
struct PassPair {
  std::function<MethodImage(const GroupedImage& crn, const GroupedImage& independent, const MethodSettings& settings)>
      image;
  bool needs_sample_count = false;  ///< whether it uses MethodSettings::crn_samples
  /// The control variates of a pixel; an empty function if there are none.
  std::function<std::vector<ControlVariate>(const GroupedImage& crn, const GroupedImage& independent, int x, int y)>
      explain;
};

/// Estimates a pixel from its samples and, for each, the first random numbers it was made from: [sample][dimension].
using PixelFunction = std::function<Spectrum(std::span<const Spectrum> values, std::span<const float> coordinates)>;

/// An independent pass, each pixel made of all its samples while it is rendered, so that the film holds the image.
struct PixelPass {
  PixelFunction pixel;
  int dimensions = 0;  ///< random numbers per sample that pixel() reads
  /// Name and all options that change its pixels, for the film's settings: "polynomials dimensions=4".
  std::string film_settings;
  /// Problems with this number of samples per pixel; empty if there are none.
  std::function<std::vector<std::string>(uint32_t samples)> check_samples;
};

/// What a method needs and can do. Everything else asks it, or the registry (combine/registry.h).
struct Method {
  std::string name;     ///< as registered
  std::string summary;  ///< a few words, for lists
  std::string text;     ///< name and options as given: "iicv --paper --k 50"
  std::string network;  ///< name and version of the neural network it uses; empty if none

  std::variant<OnePass, PassPair, PixelPass> passes;
  std::optional<AdaptiveSampling> adaptive;  ///< never set for PixelPass
  /// Minimum number of groups in each pass. All methods accept groups whose sizes differ by one sample.
  int min_groups = 1;

  bool predicts_error = false;  ///< whether it predicts the error of its image
  /// Whether held-out samples tell the error of its image (held_out_error.h).
  bool holds_out = false;
  /// Samples per pixel, over all passes, below which the predicted error was found to be unreliable.
  uint32_t reliable_samples = 0;
  bool reads_features = false;  ///< whether it uses MethodSettings::features

  int halo = 0;  ///< extra rows on each side that a band of rows needs; -1: needs the whole image
  /// The image of all rows, with the same bits, for methods whose bands share more than pixels; otherwise empty.
  /// Without layers; features are those of the whole image.
  std::function<MethodImage(const SamplesInRows& samples, const MethodSettings& settings)> image_in_rows;
  MethodMemory memory;
  /// Images of intermediate steps by name, for output; an empty function if the method has none.
  std::function<std::map<std::string, Image>(const Samples& samples, const MethodSettings& settings)> stages;

  const OnePass* one_pass() const { return std::get_if<OnePass>(&passes); }
  const PassPair* pair() const { return std::get_if<PassPair>(&passes); }
  const PixelPass* pixel_pass() const { return std::get_if<PixelPass>(&passes); }
  /// The plain mean of the samples.
  bool is_mean() const { return one_pass() && one_pass()->is_mean; }
  /// The film of the last pass holds the image.
  bool film_holds_image() const { return is_mean() || pixel_pass(); }
  /// Whether it uses MethodSettings::layers.
  bool splits_layers() const { return one_pass() && !adaptive; }

  /// The image of these samples; of a PixelPass, whose samples are pixels, their mean.
  MethodImage image(const Samples& samples, const MethodSettings& settings) const;
};

/// For a function of grouped images whose options include `std_error` and a probe.
template <typename Function, typename Options>
PassPair pair_by(Function function, const Options& options) {
  PassPair pair;
  pair.image = [function, options](const GroupedImage& crn, const GroupedImage& independent,
                                   const MethodSettings& settings) {
    Options own = options;
    own.std_error = settings.std_error;
    return function(crn, independent, own);
  };
  pair.explain = [function, options](const GroupedImage& crn, const GroupedImage& independent, int x, int y) {
    PixelProbe probe{x, y, {}};
    Options probing = options;
    probing.probe = &probe;
    function(crn, independent, probing);
    return probe.control_variates;
  };
  return pair;
}

}  // namespace covary
