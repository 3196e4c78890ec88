// SPDX-License-Identifier: Apache-2.0
#include "estimators/region_filter.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/parallel.h"

namespace covary {
namespace {

constexpr int kMaxSide = 63;

/// A pixel of the largest square, relative to its centre, in the order in which growing squares reach it.
struct Place {
  int dx, dy;
  float distance;
};

/// The pixels that the square of side m adds to that of side m - 1 are [first[m - 1], first[m]).
struct Places {
  std::vector<Place> list{{0, 0, 0}};
  std::vector<size_t> first{0, 1};

  explicit Places(int max_side) {
    for (int m = 2; m <= max_side; ++m) {
      const int low = -((m - 1) / 2), high = m / 2, before_low = -((m - 2) / 2), before_high = (m - 1) / 2;
      for (int dy = low; dy <= high; ++dy)
        for (int dx = low; dx <= high; ++dx) {
          if (dx >= before_low && dx <= before_high && dy >= before_low && dy <= before_high) continue;
          list.push_back({dx, dy, std::sqrt(static_cast<float>(dx * dx + dy * dy))});
        }
      first.push_back(list.size());
    }
  }
};

/// The pixels of a region so far.
struct Region {
  int size = 0;
  float sum_of_differences = 0;
  float difference[kMaxSide * kMaxSide];
  const Place* place[kMaxSide * kMaxSide];
};

/// Weights before they are divided by their sum.
struct Kernel {
  float slope, offset, height;  // f = offset - slope * difference, d = height - distance

  Kernel(const Region& region, float deviation, int side, Pyramid pyramid) {
    const auto M = static_cast<float>(region.size);
    slope = 1 / (deviation * std::sqrt(M));  // sqrt(N) / (3 sigma sqrt(M))
    offset = 1 / M + slope * region.sum_of_differences / M;
    height = static_cast<float>(pyramid == Pyramid::kSide ? side : region.size) * std::sqrt(0.5f);
  }
  float weight(const Region& region, int i) const {
    return std::max(0.0f, offset - slope * region.difference[i]) * std::max(0.0f, height - region.place[i]->distance);
  }
  float sum(const Region& region) const {
    float total = 0;
    for (int i = 0; i < region.size; ++i) total += weight(region, i);
    return total;
  }
};

class RegionFilter {
 public:
  RegionFilter(const FilterInput& input, const RegionOptions& options)
      : input_(input), options_(options), places_(options.max_region) {}

  /// The pixel (x, y), with `region` to work in.
  void apply(int x, int y, Region& region, FilteredImage& result) const {
    const float count = input_.count.row(0, y)[x], variance = input_.variance.row(0, y)[x];
    region.size = 0;
    region.sum_of_differences = 0;
    add(1, x, y, count, region);
    const float deviation = 3 * std::sqrt(variance / count);
    int side = 1, size = 1;
    float sum_of_differences = 0, centre_weight = 1;
    for (int m = 2; m <= options_.max_region && count > 0 && deviation > 0 && add(m, x, y, count, region); ++m) {
      const Kernel kernel(region, deviation, m, options_.pyramid);
      const float weight = kernel.weight(region, 0) / kernel.sum(region);
      if (!(centre_weight - weight >= options_.min_centre_drop)) break;
      side = m, size = region.size, sum_of_differences = region.sum_of_differences, centre_weight = weight;
    }
    region.size = size, region.sum_of_differences = sum_of_differences;
    write(x, y, side, region, result);
  }

 private:
  /// Adds the pixels that side m adds and that lie inside the frame. False where one of them has another class.
  bool add(int m, int x, int y, float count, Region& region) const {
    const float centre[3] = {input_.dependent.row(0, y)[x], input_.dependent.row(1, y)[x],
                             input_.dependent.row(2, y)[x]};
    for (size_t i = places_.first[m - 1]; i < places_.first[m]; ++i) {
      const Place& place = places_.list[i];
      const int qx = x + place.dx, qy = y + place.dy;
      if (qx < 0 || qy < 0 || qx >= input_.width() || qy >= input_.height()) continue;
      if (input_.count.row(0, qy)[qx] != count) return false;
      const Spectrum difference(input_.dependent.row(0, qy)[qx] - centre[0],
                                input_.dependent.row(1, qy)[qx] - centre[1],
                                input_.dependent.row(2, qy)[qx] - centre[2]);
      region.difference[region.size] = length(input_.norm, difference);
      region.place[region.size] = &place;
      region.sum_of_differences += region.difference[region.size];
      ++region.size;
    }
    return true;
  }

  void write(int x, int y, int side, const Region& region, FilteredImage& result) const {
    const float count = input_.count.row(0, y)[x], variance = input_.variance.row(0, y)[x];
    result.region.pixel(x, y)[0] = static_cast<float>(region.size);
    result.centre_weight.pixel(x, y)[0] = 1;
    float squares = 1, colour[3], distortion = 0;
    for (int c = 0; c < 3; ++c) colour[c] = input_.independent.row(c, y)[x];
    if (side > 1) {
      const Kernel kernel(region, 3 * std::sqrt(variance / count), side, options_.pyramid);
      const float scale = 1 / kernel.sum(region);
      squares = colour[0] = colour[1] = colour[2] = 0;
      for (int i = 0; i < region.size; ++i) {
        const float weight = scale * kernel.weight(region, i);
        for (int c = 0; c < 3; ++c)
          colour[c] += weight * input_.independent.row(c, y + region.place[i]->dy)[x + region.place[i]->dx];
        squares += weight * weight;
        distortion += weight * region.difference[i];
      }
      result.centre_weight.pixel(x, y)[0] = scale * kernel.weight(region, 0);
    }
    std::copy_n(colour, 3, result.colour.pixel(x, y));
    result.bound.pixel(x, y)[0] =
        count > 0 ? 3 * std::sqrt(variance / count * squares) + distortion : std::numeric_limits<float>::infinity();
    result.effective_samples.pixel(x, y)[0] = count / squares;
  }

  const FilterInput& input_;
  const RegionOptions& options_;
  Places places_;
};

}  // namespace

FilteredImage region_filter(const FilterInput& input, const RegionOptions& options) {
  const RegionFilter filter(input, options);
  FilteredImage result(input.width(), input.height());
  parallel_for(input.height(), 4, [&](int y) {
    thread_local Region region;
    for (int x = 0; x < input.width(); ++x) filter.apply(x, y, region, result);
  });
  return result;
}

}  // namespace covary
