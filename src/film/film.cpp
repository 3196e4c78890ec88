// SPDX-License-Identifier: Apache-2.0
#include "film/film.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <limits>
#include <numeric>

#include "film/groups.h"

namespace covary {
namespace {

/// Groups of at least this size have their running means dithered.
constexpr uint32_t kDitheredSize = 4096;

/// Running mean of `size` + 1 samples, as float. With many samples, one that differs little from the mean does not move
/// it to the next float: rounding to nearest would lose all of these but not the rare ones that differ more, a bias. So
/// a large group's mean is rounded up as often as its fraction says, dithered by multiples of the golden ratio.
float rounded(double mean, uint32_t size) {
  if (size < kDitheredSize) return static_cast<float>(mean);
  constexpr int kDropped = 29;  // bits that a double has more than a float
  const uint64_t threshold = (size * 0x9e3779b9u) >> (32 - kDropped);
  const uint64_t bits = (std::bit_cast<uint64_t>(mean) + threshold) >> kDropped << kDropped;
  return static_cast<float>(std::bit_cast<double>(bits));
}

/// Adds a sample to the mean squared deviation of `count` samples from their group means. The group's mean moves
/// towards it, so that only the fraction `share` of the squared deviation from the old mean counts [Welford1962].
void add_deviation(double share, const float* mean, const Spectrum& sample, uint32_t count, float* deviation) {
  for (int c = 0; c < 3; ++c) {
    const double difference = static_cast<double>((&sample.r)[c]) - mean[c];
    const double value = (static_cast<double>(count) * deviation[c] + share * difference * difference) / (count + 1.0);
    deviation[c] = rounded(std::min<double>(value, std::numeric_limits<float>::max()), count);
  }
}

[[noreturn]] void fail_full(uint64_t samples, int x, int y) {
  throw Error(ErrorCode::kInput, fmt::format("{} samples at pixel ({}, {}); a film holds at most {} per pixel", samples,
                                             x, y, std::numeric_limits<uint32_t>::max()));
}

}  // namespace

size_t count_negative_pixels(const Image& image) {
  size_t count = 0;
  for (size_t i = 0; i < image.data.size(); i += image.channels)
    count += std::any_of(&image.data[i], &image.data[i] + image.channels, [](float value) { return value < 0; });
  return count;
}

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
    throw Error(ErrorCode::kInput, fmt::format("{} groups; expected 1 to {}", groups, kMaxGroups));
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
  if (const uint32_t n = count(x, y); n % static_cast<uint32_t>(groups_) != 0) {
    for (int g = 0; g < groups_ && group_size(n, groups_, g) > 0; ++g)
      for (int c = 0; c < 3; ++c) sum[c] += static_cast<double>(group_size(n, groups_, g)) * p[g * 3 + c];
    return {static_cast<float>(sum[0] / n), static_cast<float>(sum[1] / n), static_cast<float>(sum[2] / n)};
  }
  for (int i = 0; i < groups_ * 3; i += 3)
    for (int c = 0; c < 3; ++c) sum[c] += p[i + c];
  return {static_cast<float>(sum[0] / groups_), static_cast<float>(sum[1] / groups_),
          static_cast<float>(sum[2] / groups_)};
}

void Film::keep_sample_variance() {
  COVARY_CHECK(std::all_of(counts_.begin(), counts_.end(), [](uint32_t n) { return n == 0; }),
               "a film keeps the variance of all its samples");
  variance_in_groups_.assign(counts_.size() * 3, 0.0f);
}

Spectrum Film::sample_variance(int x, int y) const {
  const float* in_groups = keeps_sample_variance() ? &variance_in_groups_[index(x, y) * 3] : nullptr;
  return covary::sample_variance(groups_of(x, y), in_groups, groups_, count(x, y));
}

void Film::add(int x, int y, const Spectrum& sample) {
  uint32_t& count = counts_[index(x, y)];
  if (count == std::numeric_limits<uint32_t>::max()) fail_full(uint64_t{count} + 1, x + crop_.x, y + crop_.y);
  const uint32_t group = count % static_cast<uint32_t>(groups_), size = count / static_cast<uint32_t>(groups_);
  const double before = size, after = before + 1;
  float* mean = groups_data_.data() + (index(x, y) * groups_ + group) * 3;
  if (keeps_sample_variance())
    add_deviation(before / after, mean, sample, count, &variance_in_groups_[index(x, y) * 3]);
  for (int c = 0; c < 3; ++c) mean[c] = rounded((before * mean[c] + (&sample.r)[c]) / after, size);
  ++count;
}

void Film::add_sums(int x, int y, uint32_t added_per_group, std::span<const Spectrum> sums) {
  const auto groups = static_cast<uint32_t>(groups_);
  uint32_t& count = counts_[index(x, y)];
  COVARY_CHECK(!keeps_sample_variance(), "sums of samples do not tell their variance");
  COVARY_CHECK(sums.size() == groups && count % groups == 0, "one sum per group, and groups of equal sizes");
  if (added_per_group == 0) return;
  const uint64_t total = count + uint64_t{added_per_group} * groups;
  if (total > std::numeric_limits<uint32_t>::max()) fail_full(total, x + crop_.x, y + crop_.y);
  const double before = count / groups, after = before + added_per_group;
  float* means = groups_data_.data() + index(x, y) * groups * 3;
  for (uint32_t g = 0; g < groups; ++g)
    for (int c = 0; c < 3; ++c) means[g * 3 + c] = static_cast<float>((before * means[g * 3 + c] + sums[g][c]) / after);
  count = static_cast<uint32_t>(total);
}

void Film::set(int x, int y, uint32_t count, const Spectrum& value) {
  COVARY_CHECK(!keeps_sample_variance(), "a value of many samples does not tell their variance");
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

double Film::mean_count() const {
  const uint64_t sum = std::accumulate(counts_.begin(), counts_.end(), uint64_t{0});
  return counts_.empty() ? 0 : static_cast<double>(sum) / static_cast<double>(counts_.size());
}

}  // namespace covary
