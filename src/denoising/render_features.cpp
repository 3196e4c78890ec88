// SPDX-License-Identifier: Apache-2.0
#include "denoising/render_features.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/error.h"
#include "denoising/lamps.h"

namespace covary {
namespace {

/// The squared difference of the halves, relative to their squares, of features that are the same up to rounding.
constexpr double kRounding = 1e-6;

}  // namespace

void limit_albedo(Image& albedo) {
  for (float& value : albedo.data)
    if (!std::isnan(value)) value = std::clamp(value, 0.0f, 1.0f);
}

void MeanFeature::add(const std::string& name, std::optional<Image> image) {
  const size_t half = static_cast<size_t>(n_renders_++ % 2);
  if (!image) return;
  const int width = image->width, height = image->height;
  const size_t n_values = 3 * static_cast<size_t>(std::max(width, 0)) * static_cast<size_t>(std::max(height, 0));
  if (image->channels != 3 || n_values == 0 || image->data.size() != n_values)
    throw Error(ErrorCode::kInput, fmt::format("'{}' has {} x {} pixels of {} channels and {} values; expected 3 "
                                               "channels and as many values",
                                               name, width, height, image->channels, image->data.size()));
  for (Sum& sum : halves_) {
    if (sum.n.empty()) sum = {Image(width, height, 3), std::vector<uint16_t>(n_values / 3)};
    if (sum.image.width != width || sum.image.height != height)
      throw Error(ErrorCode::kInput, fmt::format("'{}' has {} x {} pixels, others have {} x {}", name, width, height,
                                                 sum.image.width, sum.image.height));
  }
  ++n_images_[half];
  Sum& sum = halves_[half];
  for (size_t i = 0; i < sum.n.size(); ++i) {
    if (std::isnan(image->data[3 * i])) continue;
    ++sum.n[i];
    for (size_t c = 3 * i; c < 3 * i + 3; ++c) sum.image.data[c] += image->data[c];
  }
}

Image MeanFeature::take_mean() {
  Sum& sum = halves_[0];
  for (size_t i = 0; i < sum.n.size(); ++i) {
    const int n = std::max(1, sum.n[i] + halves_[1].n[i]);
    for (size_t c = 3 * i; c < 3 * i + 3; ++c)
      sum.image.data[c] = (sum.image.data[c] + halves_[1].image.data[c]) / static_cast<float>(n);
  }
  return std::move(sum.image);
}

std::vector<uint16_t> MeanFeature::difference() const {
  const auto& [first, second] = halves_;
  std::vector<uint16_t> values(first.image.data.size());
  double differences = 0, squares = 0;  // of pixels that both have
  for (size_t i = 0; i < first.n.size(); ++i)
    for (size_t c = 3 * i; first.n[i] > 0 && second.n[i] > 0 && c < 3 * i + 3; ++c) {
      const double a = first.image.data[c] / first.n[i], b = second.image.data[c] / second.n[i];
      differences += (a - b) * (a - b), squares += a * a + b * b;
      values[c] = upper_half(static_cast<float>(a - b));
    }
  if (differences <= kRounding * squares) values.clear();
  return values;
}

std::array<float, 2> MeanFeature::factors() const {
  const float n = static_cast<float>(images());
  return {static_cast<float>(n_images_[1]) / n, -static_cast<float>(n_images_[0]) / n};
}

void RenderFeatures::add(feature::Index kind, const std::string& name, std::optional<Image> image,
                         const Image* picture) {
  COVARY_CHECK(!images_[kind], "features are added before they are used");
  if (image && kAuxiliaryFeatures[kind].is_colour) limit_albedo(*image);
  if (image && picture && kAuxiliaryFeatures[kind].is_colour && image->channels == 3) darken_lamps(*picture, *image);
  sums_[kind].add(name, std::move(image));
}

void RenderFeatures::close(feature::Index kind) {
  if (sums_[kind].images() == 0) return;
  MeanFeature sum = std::exchange(sums_[kind], {});
  if (are_of_groups_) differences_.values[kind] = sum.difference(), differences_.factors[kind] = sum.factors();
  images_[kind] = sum.take_mean();
}

std::optional<Image> RenderFeatures::take(feature::Index kind) {
  close(kind);
  return std::exchange(images_[kind], std::nullopt);
}

Features RenderFeatures::view() {
  for (size_t i = 0; i < feature::kCount; ++i) close(static_cast<feature::Index>(i));
  for (const auto& [normal, albedo] :
       {std::pair{feature::kNormal, feature::kAlbedo}, {feature::kDenoisingNormal, feature::kDenoisingAlbedo}})
    if (!images_[albedo]) images_[normal].reset(), differences_.values[normal].clear();
  Features features;
  bool differ = false;
  for (size_t i = 0; i < feature::kCount; ++i) {
    features.*kImagesOfFeatures[i] = images_[i] ? &*images_[i] : nullptr;
    differ = differ || !differences_.values[i].empty();
  }
  if (differ) features.differences = &differences_;
  return features;
}

}  // namespace covary
