// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <utility>
#include <vector>

#include "film/film.h"

namespace covary {

/// How many samples the pixels of a film shall have: one number for all, or a map with a number for each.
class SampleTarget {
 public:
  SampleTarget(uint32_t all = 0) : largest_(all) {}  // NOLINT(google-explicit-constructor): the usual case is a number
  /// `map`: row by row, as many as the film has pixels; zeros are allowed.
  explicit SampleTarget(std::vector<uint32_t> map)
      : largest_(map.empty() ? 0 : *std::max_element(map.begin(), map.end())), map_(std::move(map)) {}

  /// Samples of the pixel with this index, row by row.
  uint32_t at(size_t pixel) const { return map_.empty() ? largest_ : map_[pixel]; }
  /// The largest number of any pixel.
  uint32_t largest() const { return largest_; }
  bool is_map() const { return !map_.empty(); }
  /// Of all pixels.
  double mean() const {
    return map_.empty() ? largest_ : std::accumulate(map_.begin(), map_.end(), 0.0) / static_cast<double>(map_.size());
  }
  /// Whether it is a number, or a map of the film's size.
  bool fits(const Film& film) const { return map_.empty() || map_.size() == film.counts().size(); }

  /// Samples that `film` lacks, all pixels together, where no pixel gets more than `limit`.
  uint64_t missing(const Film& film, uint32_t limit = UINT32_MAX) const {
    uint64_t sum = 0;
    for (size_t i = 0; i < film.counts().size(); ++i) {
      const uint32_t wanted = std::min(at(i), limit), count = film.counts()[i];
      sum += wanted - std::min(count, wanted);
    }
    return sum;
  }
  /// The largest N such that every pixel of `film` has N samples or its target; largest() when all have their targets.
  uint32_t reached(const Film& film) const {
    uint32_t fewest = largest_;
    for (size_t i = 0; i < film.counts().size(); ++i)
      if (film.counts()[i] < at(i)) fewest = std::min(fewest, film.counts()[i]);
    return fewest;
  }

 private:
  uint32_t largest_;
  std::vector<uint32_t> map_;
};

/// So many samples in the middle pixel of each square of stride x stride pixels, none in others.
inline SampleTarget one_in_each_square(const CropWindow& window, int stride, uint32_t samples) {
  if (stride == 1) return samples;
  std::vector<uint32_t> map(static_cast<size_t>(window.width) * window.height);
  for (int y = stride / 2; y < window.height; y += stride)
    for (int x = stride / 2; x < window.width; x += stride) map[static_cast<size_t>(y) * window.width + x] = samples;
  return SampleTarget(std::move(map));
}

}  // namespace covary
