// SPDX-License-Identifier: Apache-2.0
#include "denoising/part_features.h"

namespace covary {
namespace {

/// What a half's image differs by; null if it does not.
const std::vector<uint16_t>* difference_of(const Features& features, feature::Index kind, int part) {
  if (part == 0 || !features.differences || features.differences->values[kind].empty()) return nullptr;
  return &features.differences->values[kind];
}

}  // namespace

Image feature_of_part(const Features& features, feature::Index kind, int part) {
  const Image* const whole = features.*kImagesOfFeatures[kind];
  if (!whole) return {};
  Image image = *whole;
  const std::vector<uint16_t>* const difference = difference_of(features, kind, part);
  if (!difference) return image;
  const float factor = features.differences->factors[kind][static_cast<size_t>(part - 1)];
  for (size_t i = 0; i < image.data.size(); ++i) image.data[i] += factor * from_upper_half((*difference)[i]);
  return image;
}

PartFeatures::PartFeatures(const Features& features, int part) : view_(features) {
  view_.differences = nullptr;
  for (size_t i = 0; i < feature::kCount; ++i) {
    const auto kind = static_cast<feature::Index>(i);
    if (!difference_of(features, kind, part)) continue;
    images_[i] = feature_of_part(features, kind, part);
    view_.*kImagesOfFeatures[i] = &images_[i];
  }
}

}  // namespace covary
