// SPDX-License-Identifier: Apache-2.0
// A film: what a render pass leaves behind. For each pixel the number of samples and the means of T groups of samples,
// which estimators need to measure variance and covariance; memory does not depend on the number of samples.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

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
  Spectrum rgb(int x, int y) const { const float* p = pixel(x, y); return {p[0], p[1], p[2]}; }
};

/// Position of the film's pixels in the full frame.
struct CropWindow {
  int x = 0, y = 0, width = 0, height = 0;
  bool operator==(const CropWindow&) const = default;
};

class Film {
 public:
  Film() = default;
  /// `frame_width` x `frame_height`: the full frame; `crop`: the part of it this film holds; `groups` >= 1.
  Film(int frame_width, int frame_height, const CropWindow& crop, int groups);

  int width() const { return crop_.width; }
  int height() const { return crop_.height; }
  int frame_width() const { return frame_width_; }
  int frame_height() const { return frame_height_; }
  const CropWindow& crop() const { return crop_; }
  int groups() const { return groups_; }

  /// Samples of the pixel; always a multiple of groups(): all groups of a pixel have the same size.
  uint32_t count(int x, int y) const { return counts_[index(x, y)]; }
  Spectrum group_mean(int x, int y, int group) const;
  /// Mean of all samples.
  Spectrum mean(int x, int y) const;
  /// Adds `added` samples to each of the pixel's groups; `sums` holds groups() sums of the new samples.
  void add(int x, int y, uint32_t added_per_group, std::span<const Spectrum> sums);
  /// The T group means of a pixel, contiguous: groups() x RGB.
  const float* groups_of(int x, int y) const { return groups_data_.data() + index(x, y) * groups_ * 3; }

  Image mean_image() const;
  Image group_image(int group) const;

  /// Free-form facts that travel with the file (seed, sampling, scene hash, version, command line, …).
  std::map<std::string, std::string> attributes;
  /// Auxiliary images of the same size by name ("Albedo", "N", "P"), 3 channels each.
  std::map<std::string, Image> aovs;

 private:
  size_t index(int x, int y) const { return static_cast<size_t>(y) * crop_.width + x; }
  int frame_width_ = 0, frame_height_ = 0;
  CropWindow crop_;
  int groups_ = 1;
  std::vector<uint32_t> counts_;    // per pixel
  std::vector<float> groups_data_;  // [pixel][group][rgb]
};

}  // namespace covary
