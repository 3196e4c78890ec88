// SPDX-License-Identifier: Apache-2.0
// Auxiliary features of several renders of one picture: their mean guides the denoising of all samples, the means of
// every second render that of the halves. Most renderers' features have noise, that of the picture's own samples.
// Guided by the mean of all, the image of one half would follow the noise of the other, which would pass for detail
// that both found.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "estimators/method.h"

namespace covary {

/// Limits values to [0, 1]; NaN stays.
void limit_albedo(Image& albedo);

/// The mean of images, and the means of the first, third, … and of the others, in which pixels that are NaN count as
/// missing.
class MeanFeature {
 public:
  /// The next render's image, of three channels, if it has one. `name`: of the render, for messages. Throws
  /// Error(kInput), naming it, if it is malformed or the size differs from the first one's.
  void add(const std::string& name, std::optional<Image> image);
  /// 0 where all are missing; nothing without images.
  std::optional<Image> mean() const;
  /// The means of both halves; the mean of all where a half's are missing. There are two images or more.
  std::array<Image, 2> halves() const;
  /// Half the mean squared difference of the first two images over their mean square; 0 with fewer.
  double noise() const { return noise_; }
  int images() const { return n_images_; }

 private:
  /// Images and their number in each pixel.
  struct Sum {
    Image image;
    std::vector<uint16_t> n;
    void add(const Image& other);
    void divide(const Image* where_missing);
  };
  void compare_with_first(const Image& second);

  std::optional<Sum> all_, first_half_;
  double noise_ = 0;
  int n_renders_ = 0, n_images_ = 0;
};

/// Features of all samples and, where they differ between renders, of both halves.
class RenderFeatures {
 public:
  /// `are_of_groups`: each render is one group of the samples; otherwise halves have no features of their own.
  explicit RenderFeatures(bool are_of_groups = true) : are_of_groups_(are_of_groups) {}

  /// The feature of the next render, as MeanFeature::add() takes it. An albedo is limited to [0, 1]: renderers that
  /// estimate it by a sample, such as Mitsuba on rough metal, write 100 and more.
  void add(feature::Index kind, const std::string& name, std::optional<Image> image);
  /// What was added, of all samples and of halves; without an albedo, there is no normal. Nothing may be added after
  /// it. Valid as long as this object lives and stays where it is.
  Features view();
  /// Takes a feature of all samples out.
  std::optional<Image> take(feature::Index kind);
  bool has(feature::Index kind) const { return means_[kind].images() > 0 || of_part_[0][kind].has_value(); }

 private:
  void finish();

  bool are_of_groups_, is_finished_ = false, has_halves_ = false;
  std::array<MeanFeature, feature::kCount> means_;
  /// Of all samples and of both halves.
  std::array<std::array<std::optional<Image>, feature::kCount>, 3> of_part_;
  std::array<Features, 2> halves_;
};

}  // namespace covary
