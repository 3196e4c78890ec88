// SPDX-License-Identifier: Apache-2.0
#include "film/merge.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <limits>
#include <optional>
#include <set>

#include "core/number_text.h"
#include "film/film_file.h"
#include "film/groups.h"
#include "film/image_file.h"
#include "film/splat_layer.h"

namespace covary {
namespace {

using Attributes = std::map<std::string, std::string>;

std::string attribute(const Attributes& attributes, const std::string& key) {
  const auto it = attributes.find(key);
  return it == attributes.end() ? "" : it->second;
}

/// The seeds of a film, "1,2,7" -> {1, 2, 7}.
std::set<uint64_t> seeds_of(const Attributes& attributes, const std::string& name) {
  const std::string text = attribute(attributes, film_key::kSeed);
  if (text.empty())
    throw Error(ErrorCode::kInput, name +
                                       ": it has no seed, by which films with the same samples are told from others; "
                                       "give each its own, in Python by film_from_groups(…, seed=1)");
  const auto fail = [&] {
    throw Error(ErrorCode::kInput, fmt::format("{}: attribute seed is '{}'; expected whole numbers below 2^64, "
                                               "separated by commas",
                                               name, text));
  };
  std::set<uint64_t> seeds;
  for (size_t begin = 0; begin <= text.size();) {
    const size_t end = std::min(text.find(',', begin), text.size());
    const std::optional<uint64_t> seed = parse_number<uint64_t>(text.substr(begin, end - begin));
    if (!seed) fail();
    seeds.insert(*seed);
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

std::string size_text(const Film& film) {
  const CropWindow& c = film.crop();
  return fmt::format("{} x {} at ({}, {}) of {} x {}", c.width, c.height, c.x, c.y, film.frame_width(),
                     film.frame_height());
}

std::string aov_names(const Film& film) {
  std::string text;
  for (const auto& [name, image] : film.aovs) text += (text.empty() ? "" : ",") + name;
  return text;
}

std::string kind_of(const Attributes& film) {
  if (!attribute(film, film_key::kLightPaths).empty()) return "light paths";
  return attribute(film, film_key::kLight).empty() ? "camera samples" : "camera samples with a light film added";
}

/// Films of light paths and of camera samples are two parts of an image and must not be merged.
void check_light(const Attributes& a, const Attributes& b, const std::string& name_a, const std::string& name_b) {
  if (kind_of(a) != kind_of(b))
    throw Error(ErrorCode::kInput, fmt::format("films cannot be merged: {} holds {}, {} holds {}; merge each kind "
                                               "alone, 'covary combine --light' adds a light film to an image",
                                               name_a, kind_of(a), name_b, kind_of(b)));
}

/// Attributes common to all films, plus the seeds; `order` receives the film indices sorted by smallest seed.
Attributes merge_attributes(std::span<const Attributes> films, std::span<const std::string> names,
                            std::vector<size_t>& order) {
  std::map<uint64_t, size_t> owner;  // seed -> film
  for (size_t i = 0; i < films.size(); ++i) {
    check_light(films[0], films[i], names[0], names[i]);
    for (const char* key : {film_key::kSampling, film_key::kSceneHash, film_key::kSettings, film_key::kLightPaths})
      check_same(key, attribute(films[0], key), attribute(films[i], key), names[0], names[i]);
    for (uint64_t seed : seeds_of(films[i], names[i])) {
      const auto [it, is_new] = owner.emplace(seed, i);
      if (!is_new)
        throw Error(ErrorCode::kInput, fmt::format("films cannot be merged: {} and {} have the same seed {} and so the "
                                                   "same samples; render with another `seed`",
                                                   names[it->second], names[i], seed));
    }
  }
  Attributes merged = films[0];
  std::erase_if(merged, [&](const auto& item) {
    return std::any_of(films.begin(), films.end(),
                       [&](const Attributes& film) { return attribute(film, item.first) != item.second; });
  });
  std::set<size_t> seen;
  std::string seeds;
  for (const auto& [seed, i] : owner) {
    seeds += (seeds.empty() ? "" : ",") + std::to_string(seed);
    if (seen.insert(i).second) order.push_back(i);
  }
  merged[film_key::kSeed] = seeds;
  const bool complete = std::all_of(films.begin(), films.end(), [](const Attributes& film) {
    return attribute(film, film_key::kComplete) != "false";
  });
  merged[film_key::kComplete] = complete ? "true" : "false";
  return merged;
}

/// Sums of n_i m_i for the groups of each pixel.
class GroupSums {
 public:
  /// `before`: samples of each pixel in the films already added.
  void add(const Film& film, std::span<const uint32_t> before) {
    const int T = film.groups();
    sums_.resize(film.data().size());
    for (size_t p = 0; p < before.size(); ++p)
      for (int g = 0; g < T; ++g) {
        const size_t from = (p * T + g) * 3, to = (p * T + (before[p] % T + g) % T) * 3;
        // Times T: with equal group sizes, these are the weights of whole pixels.
        const double weight = static_cast<double>(group_size(film.counts()[p], T, g)) * T;
        for (size_t c = 0; c < 3; ++c) sums_[to + c] += weight * film.data()[from + c];
      }
  }
  /// Divides by the sizes of the merged groups; groups without samples stay zero.
  void mean(Film& film) const {
    const int T = film.groups();
    for (size_t p = 0; p < film.counts().size(); ++p)
      for (int g = 0; g < T; ++g) {
        const double weight = static_cast<double>(group_size(film.counts()[p], T, g)) * T;
        const size_t at = (p * T + g) * 3;
        for (size_t c = 0; weight > 0 && c < 3; ++c) film.data()[at + c] = static_cast<float>(sums_[at + c] / weight);
      }
  }

 private:
  std::vector<double> sums_;
};

/// A film of common random numbers must shift the groups of all its pixels by the same number.
void check_shared_numbers(const Film& film, const Film& merged, const std::string& name) {
  const auto T = static_cast<uint32_t>(film.groups());
  std::optional<uint32_t> first;
  for (size_t p = 0; p < film.counts().size(); ++p) {
    if (film.counts()[p] == 0) continue;
    const uint32_t moved = merged.counts()[p] % T;
    if (first.value_or(moved) != moved)
      throw Error(ErrorCode::kInput,
                  fmt::format("films of common random numbers cannot be merged where pixels have different numbers of "
                              "samples modulo their {} groups, here {} and {} before {} is added: groups of different "
                              "pixels would not hold the same random numbers any more",
                              T, *first, moved, name));
    first = moved;
  }
}

/// Sums of n_i m_i for an array with the same number of values for each pixel.
class WeightedSum {
 public:
  void add(std::span<const float> values, std::span<const uint32_t> counts) {
    sums_.resize(values.size());
    const size_t per_pixel = values.size() / counts.size();
    for (size_t p = 0; p < counts.size(); ++p)
      for (size_t v = p * per_pixel; v < (p + 1) * per_pixel; ++v)
        sums_[v] += static_cast<double>(counts[p]) * values[v];
  }
  /// Divides by the total counts; pixels without samples stay zero.
  void mean(std::span<const uint32_t> counts, std::span<float> target) const {
    const size_t per_pixel = target.size() / counts.size();
    for (size_t p = 0; p < counts.size(); ++p)
      for (size_t v = p * per_pixel; counts[p] && v < (p + 1) * per_pixel; ++v)
        target[v] = static_cast<float>(sums_[v] / counts[p]);
  }

 private:
  std::vector<double> sums_;
};

/// The mean squared deviation V of a pixel's samples from their group means m_g, for films that keep it: from the sum
/// of squares of all samples, N V + sum_g N_g m_g^2, which is additive over films.
class SquareSums {
 public:
  void add(const Film& film) {
    sums_.resize(film.variance_in_groups().size());
    for (size_t i = 0; i < sums_.size(); ++i)
      sums_[i] += static_cast<double>(film.counts()[i / 3]) * film.variance_in_groups()[i] + squared_means(film, i);
  }
  /// For the merged film, whose group means must already be set.
  void variance(Film& film) const {
    for (size_t i = 0; i < sums_.size(); ++i)
      if (const uint32_t n = film.counts()[i / 3]; n > 0)
        film.variance_in_groups()[i] = static_cast<float>(std::max(0.0, sums_[i] - squared_means(film, i)) / n);
  }

 private:
  /// sum_g N_g m_g^2 of a channel of a pixel, `i` = 3 pixel + channel.
  static double squared_means(const Film& film, size_t i) {
    const float* means = film.data().data() + i / 3 * film.groups() * 3 + i % 3;
    double sum = 0;
    for (int g = 0; g < film.groups(); ++g)
      sum += group_size(film.counts()[i / 3], film.groups(), g) * static_cast<double>(means[3 * g]) * means[3 * g];
    return sum;
  }
  std::vector<double> sums_;
};

/// Merges the films that `with_film(i, use)` provides one at a time.
Film merge(std::span<const Attributes> attributes, std::span<const std::string> names,
           const std::function<void(size_t, const std::function<void(const Film&)>&)>& with_film) {
  std::vector<size_t> order;
  Attributes merged_attributes = merge_attributes(attributes, names, order);
  Film merged;
  GroupSums groups;
  SquareSums squares;
  std::map<std::string, WeightedSum> aovs;
  const std::string& first = names[order[0]];
  const auto add = [&](const Film& film, const std::string& name) {
    if (merged.counts().empty()) {
      merged = Film(film.frame_width(), film.frame_height(), film.crop(), film.groups());
      for (const auto& [aov, image] : film.aovs) merged.aovs[aov] = Image(film.width(), film.height(), image.channels);
      if (film.keeps_sample_variance()) merged.keep_sample_variance();
    }
    check_same("the size", size_text(merged), size_text(film), first, name);
    check_same("the number of groups", fmt::to_string(merged.groups()), fmt::to_string(film.groups()), first, name);
    check_same("the list of auxiliary images", aov_names(merged), aov_names(film), first, name);
    const auto keeps = [](const Film& f) { return f.keeps_sample_variance() ? "kept" : "not kept"; };
    check_same("the variance of samples", keeps(merged), keeps(film), first, name);
    if (attribute(film.attributes, film_key::kSampling) == "crn") check_shared_numbers(film, merged, name);
    groups.add(film, merged.counts());
    squares.add(film);
    for (const auto& [aov, image] : film.aovs) aovs[aov].add(image.data, film.counts());
    for (size_t p = 0; p < film.counts().size(); ++p) {
      const uint64_t total = uint64_t{merged.counts()[p]} + film.counts()[p];
      if (total > std::numeric_limits<uint32_t>::max())
        throw Error(ErrorCode::kInput,
                    fmt::format("films cannot be merged: {} samples at one pixel; a film holds at most "
                                "{}",
                                total, std::numeric_limits<uint32_t>::max()));
      merged.counts()[p] = static_cast<uint32_t>(total);
    }
  };
  for (size_t i : order) with_film(i, [&](const Film& film) { add(film, names[i]); });
  groups.mean(merged);
  squares.variance(merged);
  for (auto& [aov, image] : merged.aovs) aovs[aov].mean(merged.counts(), image.data);
  merged.attributes = std::move(merged_attributes);
  return merged;
}

}  // namespace

Film merge_films(std::span<const Film> films, std::span<const std::string> names) {
  COVARY_CHECK(!films.empty() && films.size() == names.size(), "one name per film, at least one film");
  std::vector<Attributes> attributes;
  for (const Film& film : films) attributes.push_back(film.attributes);
  return merge(attributes, names, [&](size_t i, const auto& use) { use(films[i]); });
}

Film merge_film_files(std::span<const std::string> paths) {
  COVARY_CHECK(!paths.empty(), "at least one film");
  std::vector<Attributes> attributes;
  for (const std::string& path : paths) attributes.push_back(read_film_attributes(path));
  const ImageInfo first = inspect_image(paths[0]);
  constexpr double kValue = 2 * sizeof(float) + sizeof(double);  // the film being read, the merged one, and sums
  require_image_memory(paths[0], first.place.window.width, first.place.window.height,
                       kValue * static_cast<double>(first.channels.size()));
  return merge(attributes, paths, [&](size_t i, const auto& use) { use(read_film(paths[i])); });
}

}  // namespace covary
