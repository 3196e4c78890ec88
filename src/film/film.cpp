// SPDX-License-Identifier: Apache-2.0
#include "film/film.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <numeric>
#include <set>

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
  const double before = count / static_cast<uint32_t>(groups_), after = before + added_per_group;
  float* means = groups_data_.data() + index(x, y) * groups_ * 3;
  for (int g = 0; g < groups_; ++g)
    for (int c = 0; c < 3; ++c) means[g * 3 + c] = static_cast<float>((before * means[g * 3 + c] + sums[g][c]) / after);
  count = static_cast<uint32_t>(total);
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

namespace {

std::string attribute(const Film& film, const char* key) {
  const auto it = film.attributes.find(key);
  return it == film.attributes.end() ? "" : it->second;
}

/// The seeds of a film, "1,2,7" -> {1, 2, 7}.
std::set<uint64_t> seeds_of(const Film& film, const std::string& name) {
  const std::string text = attribute(film, film_key::kSeed);
  std::set<uint64_t> seeds;
  for (size_t begin = 0; begin <= text.size();) {
    const size_t end = std::min(text.find(',', begin), text.size());
    const std::string item = text.substr(begin, end - begin);
    if (item.empty() || item.size() > 20 || item.find_first_not_of("0123456789") != std::string::npos)
      throw Error(
          ErrorCode::kInput,
          fmt::format("{}: attribute seed is '{}'; expected are whole numbers separated by commas", name, text));
    seeds.insert(std::stoull(item));
    begin = end + 1;
  }
  return seeds;
}

void check_same(const std::string& what, const std::string& a, const std::string& b, const std::string& name_a,
                const std::string& name_b) {
  if (a != b)
    throw Error(ErrorCode::kInput,
                fmt::format("films cannot be merged: {} differs: '{}' in {}, '{}' in {}", what, a, name_a, b, name_b));
}

std::string shape_text(const Film& film) {
  const CropWindow& c = film.crop();
  return fmt::format("{} x {} at ({}, {}) of {} x {}", c.width, c.height, c.x, c.y, film.frame_width(),
                     film.frame_height());
}

std::string aov_names(const Film& film) {
  std::string text;
  for (const auto& [name, image] : film.aovs) text += (text.empty() ? "" : ",") + name;
  return text;
}

/// dst = sum_i weight_i * src_i / sum_i weight_i per pixel, for arrays of `n_values` values per pixel.
void weighted_mean(std::span<const Film* const> films, const std::vector<std::span<const float>>& sources,
                   std::span<float> target, size_t n_values) {
  const size_t n_pixels = target.size() / n_values;
  for (size_t p = 0; p < n_pixels; ++p) {
    double total = 0;
    for (const Film* film : films) total += film->counts()[p];
    if (total == 0) continue;
    for (size_t v = p * n_values; v < (p + 1) * n_values; ++v) {
      double sum = 0;
      for (size_t i = 0; i < films.size(); ++i) sum += static_cast<double>(films[i]->counts()[p]) * sources[i][v];
      target[v] = static_cast<float>(sum / total);
    }
  }
}

}  // namespace

Film merge_films(std::span<const Film> films, std::span<const std::string> names) {
  COVARY_CHECK(!films.empty() && films.size() == names.size(), "one name per film, at least one film");
  const Film& first = films[0];
  std::map<uint64_t, size_t> owner;  // seed -> film
  for (size_t i = 0; i < films.size(); ++i) {
    check_same("the size", shape_text(first), shape_text(films[i]), names[0], names[i]);
    check_same("the number of groups", fmt::to_string(first.groups()), fmt::to_string(films[i].groups()), names[0],
               names[i]);
    for (const char* key : {film_key::kSampling, film_key::kSceneHash, film_key::kSettings})
      check_same(key, attribute(first, key), attribute(films[i], key), names[0], names[i]);
    check_same("the list of auxiliary images", aov_names(first), aov_names(films[i]), names[0], names[i]);
    for (uint64_t seed : seeds_of(films[i], names[i])) {
      const auto [it, is_new] = owner.emplace(seed, i);
      if (!is_new)
        throw Error(ErrorCode::kInput, fmt::format("films cannot be merged: {} and {} have the same seed {} and so the "
                                                   "same samples; render with another --seed",
                                                   names[it->second], names[i], seed));
    }
  }

  // Summing in the order of the smallest seeds makes the result independent of the order given.
  std::vector<const Film*> sorted;
  std::set<size_t> seen;
  for (const auto& [seed, i] : owner)
    if (seen.insert(i).second) sorted.push_back(&films[i]);

  Film merged(first.frame_width(), first.frame_height(), first.crop(), first.groups());
  std::vector<std::span<const float>> sources;
  for (const Film* film : sorted) sources.emplace_back(film->data());
  weighted_mean(sorted, sources, merged.data(), static_cast<size_t>(first.groups()) * 3);
  for (const auto& [name, image] : first.aovs) {
    sources.clear();
    for (const Film* film : sorted) sources.emplace_back(film->aovs.at(name).data);
    Image& target = merged.aovs[name] = Image(first.width(), first.height(), 3);
    weighted_mean(sorted, sources, target.data, 3);
  }
  for (size_t p = 0; p < merged.counts().size(); ++p) {
    uint64_t total = 0;
    for (const Film* film : sorted) total += film->counts()[p];
    if (total > std::numeric_limits<uint32_t>::max())
      throw Error(ErrorCode::kInput,
                  fmt::format("films cannot be merged: {} samples at one pixel; a film holds at most {}", total,
                              std::numeric_limits<uint32_t>::max()));
    merged.counts()[p] = static_cast<uint32_t>(total);
  }

  merged.attributes = first.attributes;
  std::erase_if(merged.attributes, [&](const auto& item) {
    return std::any_of(films.begin(), films.end(),
                       [&](const Film& film) { return attribute(film, item.first.c_str()) != item.second; });
  });
  std::string seeds;
  for (const auto& [seed, i] : owner) seeds += (seeds.empty() ? "" : ",") + std::to_string(seed);
  merged.attributes[film_key::kSeed] = seeds;
  const bool complete = std::all_of(films.begin(), films.end(),
                                    [](const Film& film) { return attribute(film, film_key::kComplete) != "false"; });
  merged.attributes[film_key::kComplete] = complete ? "true" : "false";
  return merged;
}

}  // namespace covary
