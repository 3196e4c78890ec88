// SPDX-License-Identifier: Apache-2.0
// A film: the result of a render pass. Stores for each pixel the number of samples and the means of T groups of
// samples, which estimators need to measure variance and covariance; memory is independent of the number of samples.
//
// Pixels may have any, and different, numbers of samples. Sample s belongs to group s mod T, so that group sizes follow
// from the count alone and differ by at most one (groups.h).
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/spectrum.h"

namespace covary {

/// A float image, rows top to bottom, channels interleaved.
struct Image {
  int width = 0, height = 0, channels = 0;
  std::vector<float> data;
  Image() = default;
  Image(int w, int h, int c) : width(w), height(h), channels(c), data(static_cast<size_t>(w) * h * c) {}
  float* pixel(int x, int y) { return data.data() + (static_cast<size_t>(y) * width + x) * channels; }
  const float* pixel(int x, int y) const { return data.data() + (static_cast<size_t>(y) * width + x) * channels; }
  Spectrum rgb(int x, int y) const {
    const float* p = pixel(x, y);
    return {p[0], p[1], p[2]};
  }
};

/// Pixels with a negative value in any channel, as linear combinations of images can produce.
size_t count_negative_pixels(const Image& image);

/// Position of an image's pixels in the full frame.
struct CropWindow {
  int x = 0, y = 0, width = 0, height = 0;
  bool operator==(const CropWindow&) const = default;
};

class Film {
 public:
  static constexpr int kMaxGroups = 1024;

  Film() = default;
  /// `frame_width` x `frame_height`: the full frame; `crop`: the part of it this film holds.
  /// Throws Error(kInput) when the crop is empty or not inside the frame, or `groups` is not in 1 … kMaxGroups.
  Film(int frame_width, int frame_height, const CropWindow& crop, int groups);

  int width() const { return crop_.width; }
  int height() const { return crop_.height; }
  int frame_width() const { return frame_width_; }
  int frame_height() const { return frame_height_; }
  const CropWindow& crop() const { return crop_; }
  int groups() const { return groups_; }

  /// Samples of the pixel in all groups together.
  uint32_t count(int x, int y) const { return counts_[index(x, y)]; }
  /// Zero if the group has no samples.
  Spectrum group_mean(int x, int y, int group) const;
  /// Mean of all samples: the groups weighted by their sizes. Zero if there are none.
  Spectrum mean(int x, int y) const;
  /// Adds the next sample of the pixel, number count(x, y), to its group. The bits of a pixel depend only on its
  /// samples and their order. Different pixels may be added to from different threads. Throws Error(kInput) if the
  /// pixel already has 2^32 - 1 samples.
  void add(int x, int y, const Spectrum& sample);
  /// Adds `added_per_group` samples at once to each of the pixel's groups, which must have equal sizes: `sums` holds
  /// their groups() sums. For layers that sum many samples at a time; the bits then depend on the batches. Otherwise
  /// like add().
  void add_sums(int x, int y, uint32_t added_per_group, std::span<const Spectrum> sums);
  /// From now on also keeps what sample_variance() needs to use every sample: 3 more floats per pixel. For empty films
  /// only; add_sums() and set() cannot be used afterwards.
  void keep_sample_variance();
  bool keeps_sample_variance() const { return !variance_in_groups_.empty(); }
  /// Unbiased estimate of the variance of one sample (film/groups.h): from all samples if the film keeps their
  /// variance, otherwise from its groups; zero if there are too few of either.
  Spectrum sample_variance(int x, int y) const;
  /// Sets the value of an empty pixel, computed from `count` samples jointly. For films with one group.
  void set(int x, int y, uint32_t count, const Spectrum& value);
  /// The T group means of a pixel, contiguous: groups() x RGB.
  const float* groups_of(int x, int y) const { return groups_data_.data() + index(x, y) * groups_ * 3; }

  Image mean_image() const;
  /// Samples per pixel, averaged over the film; exact if all pixels have the same count.
  double mean_count() const;

  /// Metadata stored in the file, as text; film_key names the known keys, others are preserved.
  std::map<std::string, std::string> attributes;
  /// Auxiliary images (AOVs) of the film's size by name ("Albedo", "N", "P"), 3 channels each.
  std::map<std::string, Image> aovs;
  /// What the file shows as R G B if that is more than the film's samples; empty: their mean. Never read back.
  Image shown;

  /// The film's storage, for readers and writers: counts row-major; data as [pixel][group][rgb].
  std::vector<uint32_t>& counts() { return counts_; }
  const std::vector<uint32_t>& counts() const { return counts_; }
  std::vector<float>& data() { return groups_data_; }
  const std::vector<float>& data() const { return groups_data_; }
  /// Mean squared deviation of a pixel's samples from the means of their groups, [pixel][rgb]; empty if not kept.
  std::vector<float>& variance_in_groups() { return variance_in_groups_; }
  const std::vector<float>& variance_in_groups() const { return variance_in_groups_; }

 private:
  size_t index(int x, int y) const { return static_cast<size_t>(y) * crop_.width + x; }
  int frame_width_ = 0, frame_height_ = 0;
  CropWindow crop_;
  int groups_ = 1;
  std::vector<uint32_t> counts_;    // per pixel
  std::vector<float> groups_data_;  // [pixel][group][rgb], zero if a group has no samples
  std::vector<float> variance_in_groups_;
};

/// Attribute keys known to this module.
namespace film_key {
inline constexpr const char* kSeed = "seed";             ///< decimal; after a merge all seeds, ascending: "1,2,7"
inline constexpr const char* kSampling = "sampling";     ///< "independent" or "crn"
inline constexpr const char* kSceneHash = "scene_hash";  ///< hash of the scene's content
inline constexpr const char* kSettings = "settings";     ///< all options that change the samples, except the seed
inline constexpr const char* kTraining = "training";     ///< hash of what the integrator learned, if it learns
inline constexpr const char* kLightPaths = "light_paths_per_sample";  ///< light films only (splat_layer.h)
inline constexpr const char* kVersion = "version";                    ///< of the program
inline constexpr const char* kCommand = "command";                    ///< command line
inline constexpr const char* kComplete = "complete";                  ///< "true", or "false" for an interrupted render
}  // namespace film_key

}  // namespace covary
