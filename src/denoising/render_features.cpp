// SPDX-License-Identifier: Apache-2.0
#include "denoising/render_features.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/error.h"

namespace covary {
namespace {

/// MeanFeature::noise() of features that differ by more than rounding.
constexpr double kRounding = 1e-6;

Features view_of(const std::array<std::optional<Image>, feature::kCount>& images) {
  Features features;
  for (size_t i = 0; i < images.size(); ++i) features.*kImagesOfFeatures[i] = images[i] ? &*images[i] : nullptr;
  return features;
}

}  // namespace

void limit_albedo(Image& albedo) {
  for (float& value : albedo.data)
    if (!std::isnan(value)) value = std::clamp(value, 0.0f, 1.0f);
}

void MeanFeature::Sum::add(const Image& other) {
  for (size_t i = 0; i < n.size(); ++i) {
    if (std::isnan(other.data[3 * i])) continue;
    ++n[i];
    for (size_t c = 3 * i; c < 3 * i + 3; ++c) image.data[c] += other.data[c];
  }
}

void MeanFeature::Sum::divide(const Image* where_missing) {
  for (size_t i = 0; i < n.size(); ++i)
    for (size_t c = 3 * i; c < 3 * i + 3; ++c) {
      if (n[i] > 1) image.data[c] /= n[i];
      if (n[i] == 0 && where_missing) image.data[c] = where_missing->data[c];
    }
}

void MeanFeature::add(const std::string& name, std::optional<Image> image) {
  const bool is_first_half = n_renders_++ % 2 == 0;
  if (!image) return;
  const int width = image->width, height = image->height;
  const size_t n_values = 3 * static_cast<size_t>(std::max(width, 0)) * static_cast<size_t>(std::max(height, 0));
  if (image->channels != 3 || n_values == 0 || image->data.size() != n_values)
    throw Error(ErrorCode::kInput, fmt::format("'{}' has {} x {} pixels of {} channels and {} values; expected 3 "
                                               "channels and as many values",
                                               name, width, height, image->channels, image->data.size()));
  if (!all_) {
    const std::vector<uint16_t> none(image->data.size() / 3);
    all_ = {Image(width, height, 3), none}, first_half_ = all_;
  }
  const Image& sum = all_->image;
  if (sum.width != width || sum.height != height)
    throw Error(ErrorCode::kInput, fmt::format("'{}' has {} x {} pixels, others have {} x {}", name, width, height,
                                               sum.width, sum.height));
  if (++n_images_ == 2) compare_with_first(*image);
  if (is_first_half) first_half_->add(*image);
  all_->add(*image);
}

void MeanFeature::compare_with_first(const Image& second) {
  double differences = 0, squares = 0;  // of pixels that both have
  const Image& first = all_->image;
  for (size_t i = 0; i < all_->n.size(); ++i)
    for (size_t c = 3 * i; all_->n[i] == 1 && std::isfinite(second.data[3 * i]) && c < 3 * i + 3; ++c) {
      const double a = first.data[c], b = second.data[c];
      differences += (a - b) * (a - b), squares += a * a + b * b;
    }
  noise_ = squares > 0 ? differences / squares : 0;
}

std::optional<Image> MeanFeature::mean() const {
  if (!all_) return std::nullopt;
  Sum mean = *all_;
  mean.divide(nullptr);
  return std::move(mean.image);
}

std::array<Image, 2> MeanFeature::halves() const {
  const Image whole = *mean();
  Sum first = *first_half_, second = *all_;
  for (size_t i = 0; i < second.n.size(); ++i) {
    second.n[i] = static_cast<uint16_t>(second.n[i] - first.n[i]);
    for (size_t c = 3 * i; c < 3 * i + 3; ++c) second.image.data[c] -= first.image.data[c];
  }
  first.divide(&whole), second.divide(&whole);
  return {std::move(first.image), std::move(second.image)};
}

void RenderFeatures::add(feature::Index kind, const std::string& name, std::optional<Image> image) {
  COVARY_CHECK(!is_finished_, "features are added before they are used");
  if (image && kAuxiliaryFeatures[kind].is_colour) limit_albedo(*image);
  means_[kind].add(name, std::move(image));
}

void RenderFeatures::finish() {
  if (std::exchange(is_finished_, true)) return;
  has_halves_ = are_of_groups_ && means_[feature::kAlbedo].images() > 1 &&
                std::any_of(means_.begin(), means_.end(), [](const MeanFeature& m) { return m.noise() > kRounding; });
  for (size_t i = 0; i < means_.size(); ++i) {
    const MeanFeature mean = std::exchange(means_[i], {});
    const bool is_normal = i == feature::kNormal || i == feature::kDenoisingNormal;
    if (is_normal && !of_part_[0][i == feature::kNormal ? feature::kAlbedo : feature::kDenoisingAlbedo]) continue;
    of_part_[0][i] = mean.mean();
    if (!has_halves_ || mean.images() == 0) continue;
    std::array<Image, 2> halves = mean.images() > 1 ? mean.halves() : std::array{*of_part_[0][i], *of_part_[0][i]};
    for (size_t half : {0, 1}) of_part_[half + 1][i] = std::move(halves[half]);
  }
  for (size_t half : {0, 1}) halves_[half] = view_of(of_part_[half + 1]);
}

std::optional<Image> RenderFeatures::take(feature::Index kind) {
  finish();
  return std::exchange(of_part_[0][kind], std::nullopt);
}

Features RenderFeatures::view() {
  finish();
  Features features = view_of(of_part_[0]);
  if (has_halves_) features.halves = {&halves_[0], &halves_[1]};
  return features;
}

}  // namespace covary
