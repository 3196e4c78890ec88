// SPDX-License-Identifier: Apache-2.0
#include "dependent_tests/region_filter.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/parallel.h"

namespace covary {
namespace {

using namespace lanes;

/// A pixel of the largest square, relative to its centre, in the order in which growing squares reach it.
struct Place {
  int dx, dy;
  float distance;
  float side;  ///< of the smallest square that contains it
};

/// The pixels that the square of side m adds to that of side m - 1 are [first[m - 1], first[m]).
struct Places {
  std::vector<Place> list{{0, 0, 0, 1}};
  std::vector<size_t> first{0, 1};

  explicit Places(int max_side) {
    for (int m = 2; m <= max_side; ++m) {
      const int low = -((m - 1) / 2), high = m / 2, before_low = -((m - 2) / 2), before_high = (m - 1) / 2;
      for (int dy = low; dy <= high; ++dy)
        for (int dx = low; dx <= high; ++dx) {
          if (dx >= before_low && dx <= before_high && dy >= before_low && dy <= before_high) continue;
          list.push_back({dx, dy, std::sqrt(static_cast<float>(dx * dx + dy * dy)), static_cast<float>(m)});
        }
      first.push_back(list.size());
    }
  }
};

/// The region of each lane: side m, number M of pixels inside the frame, sum of their Delta.
struct Region {
  vfloat side = splat(1), size = splat(1), differences{};
};

/// Weights before normalisation, [Csonka2002] Sec. 4: with f = 1/M + sqrt(N) / (3 sigma sqrt(M)) (mean of Delta -
/// Delta_q) and d by distance, the weights are f* = max(f, 0) d over their sum.
struct Kernel {
  vfloat slope, offset, reach;  // f = offset - slope * Delta; d is 0, or small, where the distance is `reach`
  Falloff falloff;

  Kernel(const Region& region, vfloat deviation, Falloff by_distance)
      : slope(1.0f / (deviation * sqrt(region.size))),  // sqrt(N) / (3 sigma sqrt(M))
        offset(1.0f / region.size + slope * region.differences / region.size),
        reach((by_distance == Falloff::kCount ? region.size : region.side) * std::sqrt(0.5f)),
        falloff(by_distance) {}

  /// d
  vfloat by_distance(float distance) const {
    if (falloff == Falloff::kGaussian) {
      const vfloat u = splat(distance) / reach;
      return exp_of_nonpositive(-2.0f * u * u);
    }
    if (falloff == Falloff::kSpline) {
      const vfloat u = min(splat(2 * distance) / reach, splat(2)), left = 2.0f - u;
      const vfloat inner = 2.0f / 3.0f - u * u + 0.5f * u * u * u, outer = left * left * left / 6.0f;
      return u < splat(1) ? inner : outer;
    }
    return max(reach - distance, splat(0));
  }
  vfloat weight(vfloat difference, float distance) const {
    return max(offset - slope * difference, splat(0)) * by_distance(distance);  // f+ d, Sec. 4
  }
};

bool any(vint mask) {
  int32_t all = 0;
  for (int l = 0; l < kLanes; ++l) all |= mask[l];
  return all != 0;
}

/// The regions of kLanes adjacent pixels.
class RegionBatch {
 public:
  RegionBatch(const FilterInput& input, const RegionOptions& options, const Places& places)
      : input_(input),
        options_(options),
        places_(places),
        differences_(places.list.size()),
        inside_(places.list.size(), splat(1)) {
    for (int l = 0; l < kLanes; ++l) lane_[l] = l;
  }

  /// Writes the first n pixels of the batch at (x, y).
  void apply(int x, int y, int n, FilteredImage& result) {
    x_ = x, y_ = y;
    count_ = load(input_.count.row(0, y) + x);
    variance_ = load(input_.variance.row(0, y) + x);
    deviation_ = 3.0f * sqrt(variance_ / count_);
    write(grown(), n, result);
  }

 private:
  /// Grows the regions while their pixels are of one class and the centre's weight falls enough.
  Region grown() {
    Region region, accepted;
    vfloat centre_weight = splat(1);
    vint grows = (count_ > splat(0)) & (deviation_ > splat(0));
    for (int m = 2; m <= options_.max_region && any(grows); ++m) {
      grows &= ~add_places(m, region);
      if (!any(grows)) break;
      const Kernel kernel(region, deviation_, options_.falloff);
      vfloat sum{};
      for (size_t i = 0; i < places_.first[m]; ++i)
        sum += inside_[i] * kernel.weight(differences_[i], places_.list[i].distance);
      const vfloat weight = kernel.weight(splat(0), 0) / sum;  // f*[0]; Sec. 5: stop where it falls too little
      grows &= centre_weight - weight >= splat(options_.min_centre_drop);
      accepted.side = grows ? region.side : accepted.side;
      accepted.size = grows ? region.size : accepted.size;
      accepted.differences = grows ? region.differences : accepted.differences;
      centre_weight = grows ? weight : centre_weight;
    }
    return accepted;
  }

  /// Adds the pixels that side m adds and that lie inside the frame. Returns the lanes where one of them has another
  /// class.
  vint add_places(int m, Region& region) {
    const Planes& d = input_.dependent;
    const vfloat r = load(d.row(0, y_) + x_), g = load(d.row(1, y_) + x_), b = load(d.row(2, y_) + x_);
    vint differs{};
    region.side = splat(static_cast<float>(m));
    for (size_t i = places_.first[m - 1]; i < places_.first[m]; ++i) {
      const int qx = x_ + places_.list[i].dx, qy = y_ + places_.list[i].dy;
      const vint column = lane_ + qx;
      const vint inside = (column >= splat_int(0)) & (column < splat_int(input_.width())) &
                          splat_int(qy >= 0 && qy < input_.height() ? -1 : 0);
      const vfloat dr = load(d.row(0, qy) + qx) - r, dg = load(d.row(1, qy) + qx) - g, db = load(d.row(2, qy) + qx) - b;
      const vfloat length = input_.norm == Norm::kEuclidean ? sqrt(squared_length(dr, dg, db))
                                                            : max(dr, -dr) + max(dg, -dg) + max(db, -db);
      differs |= inside & (load(input_.count.row(0, qy) + qx) != count_);
      inside_[i] = inside ? splat(1) : splat(0);
      differences_[i] = inside ? length : splat(0);
      region.size += inside_[i];
      region.differences += differences_[i];
    }
    return differs;
  }

  void write(const Region& region, int n, FilteredImage& result) const {
    const Kernel kernel(region, deviation_, options_.falloff);
    float side = 1;
    for (int l = 0; l < n; ++l) side = std::max(side, region.side[l]);
    const size_t last = places_.first[static_cast<size_t>(side)];
    const auto weight_of = [&](size_t i) {
      const Place& place = places_.list[i];
      const vfloat weight = inside_[i] * kernel.weight(differences_[i], place.distance);
      return splat(place.side) <= region.side ? weight : splat(0);
    };
    vfloat sum{}, squares{}, distortion{}, colour[3] = {};
    for (size_t i = 0; i < last; ++i) sum += weight_of(i);
    for (size_t i = 0; i < last; ++i) {
      const vfloat weight = weight_of(i) / sum;  // f* of [Csonka2002] Sec. 4
      const int qx = x_ + places_.list[i].dx, qy = y_ + places_.list[i].dy;
      for (int c = 0; c < 3; ++c) colour[c] += weight * load(input_.independent.row(c, qy) + qx);  // Eq. (1)
      squares += weight * weight;
      distortion += weight * differences_[i];
    }
    const vint alone = region.side <= splat(1);
    for (int c = 0; c < 3; ++c) colour[c] = alone ? load(input_.independent.row(c, y_) + x_) : colour[c];
    squares = alone ? splat(1) : squares;
    distortion = alone ? splat(0) : distortion;
    const vfloat centre = alone ? splat(1) : kernel.weight(splat(0), 0) / sum;
    // The error bound of [Csonka2002] Sec. 4.
    const vfloat bound = count_ > splat(0) ? 3.0f * sqrt(variance_ / count_ * squares) + distortion
                                           : splat(std::numeric_limits<float>::infinity());
    for (int l = 0; l < n; ++l) {
      for (int c = 0; c < 3; ++c) result.colour.pixel(x_ + l, y_)[c] = colour[c][l];
      result.region.pixel(x_ + l, y_)[0] = region.size[l];
      result.centre_weight.pixel(x_ + l, y_)[0] = centre[l];
      result.bound.pixel(x_ + l, y_)[0] = bound[l];
      result.effective_samples.pixel(x_ + l, y_)[0] = count_[l] / squares[l];
    }
  }

  const FilterInput& input_;
  const RegionOptions& options_;
  const Places& places_;
  int x_ = 0, y_ = 0;
  vint lane_{};
  vfloat count_{}, variance_{}, deviation_{};
  std::vector<vfloat> differences_, inside_;  ///< Delta of the places so far; 1 inside the frame, otherwise 0
};

}  // namespace

FilteredImage region_filter(const FilterInput& input, const RegionOptions& options) {
  const Places places(options.max_region);
  FilteredImage result(input.width(), input.height());
  parallel_for(input.height(), 4, [&](int y) {
    RegionBatch batch(input, options, places);
    for (int x = 0; x < input.width(); x += kLanes) batch.apply(x, y, std::min(kLanes, input.width() - x), result);
  });
  return result;
}

}  // namespace covary
