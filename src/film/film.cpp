// SPDX-License-Identifier: Apache-2.0
#include "film/film.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <numeric>

namespace covary {

Film::Film(int frame_width, int frame_height, const CropWindow& crop, int groups)
    : frame_width_(frame_width), frame_height_(frame_height), crop_(crop), groups_(groups) {
  if (frame_width < 1 || frame_height < 1)
    throw Error(ErrorCode::kInput,
                fmt::format("a film of {} x {} pixels; both must be at least 1", frame_width, frame_height));
  if (crop.width < 1 || crop.height < 1 || crop.x < 0 || crop.y < 0 || crop.x > frame_width - crop.width ||
      crop.y > frame_height - crop.height)
    throw Error(ErrorCode::kInput,
                fmt::format("the crop of {} x {} pixels at ({}, {}) is empty or not inside the frame of {} x {}",
                            crop.width, crop.height, crop.x, crop.y, frame_width, frame_height));
  if (groups < 1 || groups > kMaxGroups)
    throw Error(ErrorCode::kInput, fmt::format("{} groups; accepted are 1 to {}", groups, kMaxGroups));
  const size_t n_pixels = static_cast<size_t>(crop.width) * crop.height;
  counts_.assign(n_pixels, 0);
  groups_data_.assign(n_pixels * groups * 3, 0.0f);
}

Spectrum Film::group_mean(int x, int y, int group) const {
  const float* p = groups_of(x, y) + group * 3;
  return {p[0], p[1], p[2]};
}

Spectrum Film::mean(int x, int y) const {
  const float* p = groups_of(x, y);
  if (groups_ == 1) return {p[0], p[1], p[2]};
  double sum[3] = {0, 0, 0};
  for (int i = 0; i < groups_ * 3; i += 3)
    for (int c = 0; c < 3; ++c) sum[c] += p[i + c];
  return {static_cast<float>(sum[0] / groups_), static_cast<float>(sum[1] / groups_),
          static_cast<float>(sum[2] / groups_)};
}

void Film::add(int x, int y, uint32_t added_per_group, std::span<const Spectrum> sums) {
  COVARY_CHECK(sums.size() == static_cast<size_t>(groups_), "one sum per group");
  if (added_per_group == 0) return;
  uint32_t& count = counts_[index(x, y)];
  const uint64_t total = count + uint64_t{added_per_group} * groups_;
  if (total > std::numeric_limits<uint32_t>::max())
    throw Error(ErrorCode::kInput, fmt::format("{} samples at pixel ({}, {}); a film holds at most {} per pixel", total,
                                               x + crop_.x, y + crop_.y, std::numeric_limits<uint32_t>::max()));
  const uint32_t per_group = count / static_cast<uint32_t>(groups_);
  const double before = per_group, after = before + added_per_group;
  float* means = groups_data_.data() + index(x, y) * groups_ * 3;
  for (int g = 0; g < groups_; ++g)
    for (int c = 0; c < 3; ++c) means[g * 3 + c] = static_cast<float>((before * means[g * 3 + c] + sums[g][c]) / after);
  count = static_cast<uint32_t>(total);
}

void Film::set(int x, int y, uint32_t count, const Spectrum& value) {
  COVARY_CHECK(groups_ == 1 && counts_[index(x, y)] == 0, "only a pixel without samples and groups can be set");
  std::copy_n(&value.r, 3, groups_data_.data() + index(x, y) * 3);
  counts_[index(x, y)] = count;
}

Image Film::mean_image() const {
  Image image(width(), height(), 3);
  for (int y = 0; y < height(); ++y)
    for (int x = 0; x < width(); ++x) {
      const Spectrum m = mean(x, y);
      std::copy_n(&m.r, 3, image.pixel(x, y));
    }
  return image;
}

Image Film::group_image(int group) const {
  COVARY_CHECK(group >= 0 && group < groups_, fmt::format("group {} of {}", group, groups_));
  Image image(width(), height(), 3);
  for (int y = 0; y < height(); ++y)
    for (int x = 0; x < width(); ++x) std::copy_n(groups_of(x, y) + group * 3, 3, image.pixel(x, y));
  return image;
}

double Film::mean_count() const {
  const uint64_t sum = std::accumulate(counts_.begin(), counts_.end(), uint64_t{0});
  return counts_.empty() ? 0 : static_cast<double>(sum) / static_cast<double>(counts_.size());
}

}  // namespace covary
