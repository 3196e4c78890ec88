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

/// The mean of the images of renders, in which pixels that are NaN count as missing, and what the means of the first,
/// third, … and of the others differ by.
class MeanFeature {
 public:
  /// The next render's image, of three channels, if it has one. `name`: of the render, for messages. Throws
  /// Error(kInput), naming it, if it is malformed or the size differs from the first one's.
  void add(const std::string& name, std::optional<Image> image);
  int images() const { return n_images_[0] + n_images_[1]; }
  /// 0 where all are missing. Once, of one image or more.
  Image take_mean();
  /// FeatureDifferences::values and factors, 0 where a half has none; empty if halves differ by no more than rounding.
  std::vector<uint16_t> difference() const;
  std::array<float, 2> factors() const;

 private:
  /// Images of a half and their number in each pixel.
  struct Sum {
    Image image;
    std::vector<uint16_t> n;
  };

  std::array<Sum, 2> halves_;
  std::array<int, 2> n_images_ = {0, 0};
  int n_renders_ = 0;
};

/// Features of all samples and, where they differ between renders, of both halves.
class RenderFeatures {
 public:
  /// `are_of_groups`: each render is one group of the samples; otherwise halves have no features of their own.
  explicit RenderFeatures(bool are_of_groups = true) : are_of_groups_(are_of_groups) {}

  /// The feature of the next render, as MeanFeature::add() takes it. An albedo is limited to [0, 1]: renderers that
  /// estimate it by a sample, such as Mitsuba on rough metal, write 100 and more. With the render's `picture`, it is
  /// darkened where that shows lamps (lamps.h).
  void add(feature::Index kind, const std::string& name, std::optional<Image> image, const Image* picture = nullptr);
  /// Nothing more of this kind is added: gives memory back.
  void close(feature::Index kind);
  /// What was added, of all samples and of halves; without an albedo, there is no normal. Nothing may be added after
  /// it. Valid as long as this object lives and stays where it is.
  Features view();
  /// Takes a feature of all samples out.
  std::optional<Image> take(feature::Index kind);
  bool has(feature::Index kind) const { return sums_[kind].images() > 0 || images_[kind].has_value(); }

 private:
  bool are_of_groups_;
  std::array<MeanFeature, feature::kCount> sums_;
  std::array<std::optional<Image>, feature::kCount> images_;
  FeatureDifferences differences_;
};

}  // namespace covary
