// SPDX-License-Identifier: Apache-2.0
// Tiles of the image are processed in parallel; within a tile, bands of rows from top to bottom, and within a band a
// few offsets o = j - i at a time. All inner loops run along rows. A pixel pair (p, p + o) gives the weight of p + o
// for p, `forward`, and of p for p + o, `backward`: both have the same feature distance and the same quotient. So half
// of all offsets suffice, if pairs that reach into the tile from outside are included. Patch distances are summed over
// rows of three pixels, then over three rows, of which the last two are kept. Weights are not kept beyond a row.
#include "filters/nl_means.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "core/error.h"
#include "core/parallel.h"

namespace covary {
namespace {

using namespace lanes;

constexpr int kPatch = 1;  // radius
constexpr int kBorder = kNlMeansRadius + kPatch;
constexpr float kOfPatch = 3 * (2 * kPatch + 1) * (2 * kPatch + 1);  // values in a patch
/// Maximum number of pairs in a row; tile width such that the pairs touching the tile are no more. `kTileHeight`: pairs
/// are not many more than pixels. `kBand`: the data of its rows stays in the L2 cache.
constexpr int kRow = 256, kTileWidth = kRow - kNlMeansRadius - 2 * kPatch, kTileHeight = 64, kBand = 16;
/// Strides between rows and between planes of a tile with its border.
constexpr ptrdiff_t kStride = kTileWidth + 2 * kBorder + kLanes, kPlane = kStride * (kTileHeight + 2 * kBorder);
/// Values per pixel in a total: three channels and the sum of weights.
constexpr int kSums = 4;
/// Offsets whose pixels are summed together.
constexpr int kAtOnce = 7;
/// Sums of two squared errors below the first count as none; squared errors are limited to the second.
constexpr float kSmallestVariance = 1e-10f, kLargestVariance = 1e30f;

/// The terms common to both directions of a pair, summed over three channels: with v, u the variances of its pixels, A
/// = ((f - f')^2 - min(v, u)) / (v + u) and B = v / (v + u). The forward distance is A - B, the backward one A - (1 -
/// B).
struct PairSums {
  vfloat a = {}, b = {};
};

/// For pixels in a row and those `there` floats further on.
PairSums pixel_sums(const float* f, const float* variance, ptrdiff_t there) {
  PairSums sum;
  for (int c = 0; c < 3; ++c, f += kPlane, variance += kPlane) {
    const vfloat difference = load(f) - load(f + there);
    vfloat v = load(variance), u = load(variance + there);
    keep_in_register(v), keep_in_register(u);
    const vfloat quotient = reciprocal(v + u);
    sum.a = fma(fma(difference, difference, -min(v, u)), quotient, sum.a);
    sum.b = fma(v, quotient, sum.b);
  }
  return sum;
}

/// Sums over three neighbours, starting at each lane of a, which b continues.
vfloat sum_of_three(vfloat a, vfloat b) { return a + shift<1>(a, b) + shift<2>(a, b); }

/// A part of the image, and the pixels p of pairs (p, p + (dx, dy)) that touch it, relative to its corner.
struct Tile {
  int x, y, width, height;

  int left(int dx) const { return std::min(0, -dx); }
  int n_pairs(int dx) const { return width + std::abs(dx); }
};

/// Copies the image around a tile to planes `first` and up, channel by channel, repeating the frame's outermost pixels
/// beyond it.
void copy_around(const Tile& tile, const Image& image, bool is_error, int first, Planes& planes) {
  for (int y = -kBorder; y < tile.height + kBorder; ++y) {
    const float* const pixels = image.pixel(0, std::clamp(tile.y + y, 0, image.height - 1));
    for (int c = 0; c < 3; ++c) {
      float* const row = planes.row(first + c, y);
      for (int x = -kBorder; x < tile.width + kBorder; ++x) {
        const float value = pixels[3 * std::clamp(tile.x + x, 0, image.width - 1) + c];
        row[x] = is_error ? std::min(value * value, kLargestVariance) + kSmallestVariance / 2 : value;
      }
    }
  }
}

/// An image to be averaged, and the tasks whose weights it uses.
struct Source {
  struct Use {
    size_t task, total;  // indices into weights and totals
  };
  const Image* image;
  std::vector<Use> uses;
};

/// A steering image with the images averaged by it, itself first. Tasks are ordered from widest to narrowest.
struct Steering {
  const Image* std_error;
  std::vector<float> scales;  // per task, from distances to exponents; 0: four times the previous exponent
  std::vector<Source> sources;

  /// Planes of a tile: the image, its squared errors, and all other sources.
  int n_planes() const { return 3 + 3 * static_cast<int>(sources.size()); }
  static int first_plane(size_t source) { return source == 0 ? 0 : 3 + 3 * static_cast<int>(source); }
};

class Filter {
 public:
  Filter(std::span<const NlMeansSteering> steerings, const Planes* features, const std::vector<unsigned char>& valid,
         const WantedRows& wanted)
      : width_(steerings[0].image->width),
        height_(steerings[0].image->height),
        wanted_(wanted),
        features_(features),
        valid_(valid) {
    COVARY_CHECK(!features_ || features_->border() >= kNlMeansRadius, "features have the border that NL-means reads");
    for (const NlMeansSteering& given : steerings) add_steering(given);
    images_.resize(results_.size(), Image(width_, height_, 3));
  }

  std::vector<Image> run() {
    // Tiles are those of the whole image, so that the order of its sums does not depend on the rows that are given.
    const int first_row = wanted_.first_row, end = first_row + std::min(height_, wanted_.end);
    const int columns = (width_ + kTileWidth - 1) / kTileWidth, first = (first_row + wanted_.first) / kTileHeight;
    const int rows = (end + kTileHeight - 1) / kTileHeight - first;
    PerThread<Buffers> buffers;
    parallel_for(columns * rows, [&](int number) {
      const int x = number % columns * kTileWidth, y = (first + number / columns) * kTileHeight - first_row;
      filter_tile({x, y, std::min(kTileWidth, width_ - x), std::min(kTileHeight, height_ - y)}, buffers.local());
    });
    return std::move(images_);
  }

 private:
  /// Values of pairs in a row, starting with the first pair.
  struct alignas(sizeof(vfloat)) Row {
    std::array<float, kRow + sizeof(vfloat) / sizeof(float) + kNlMeansRadius> data;
    float* begin() { return data.data(); }
    const float* begin() const { return data.data(); }
  };
  using Rows = std::array<Row, kAtOnce>;  // one per offset
  /// Scratch for kAtOnce offsets at a time.
  struct Buffers {
    std::vector<Planes> planes;                       // per steering
    Planes mask;                                      // 1 at valid pixels, 0 elsewhere and outside
    std::array<std::array<Rows, 2>, kBand> features;  // exp(-||q_p - q_(p + o)||^2), for valid p + o, and for valid p
    std::array<std::array<Rows, 2>, 2> pair_sums;     // A and B, summed over three pixels; for even and odd rows
    std::vector<std::array<Rows, 2>> weights;         // per task, forward and backward
    std::vector<float> totals;                        // per row of the tile
  };
  struct Result {
    size_t total;
    const Image* source;
  };
  /// Offsets (dx, dy) ... (dx + n - 1, dy).
  struct Offsets {
    int dx, dy, n;
  };

  void add_steering(const NlMeansSteering& given) {
    Steering& s = steerings_.emplace_back(given.std_error);
    s.sources.push_back({given.image, {}});
    std::vector<size_t> order(given.tasks.size()), first_result;
    for (const NlMeansTask& task : given.tasks) {
      first_result.push_back(results_.size());
      results_.resize(results_.size() + task.sources.size());
    }
    std::iota(order.begin(), order.end(), 0);
    std::stable_sort(order.begin(), order.end(),
                     [&](size_t a, size_t b) { return given.tasks[a].bandwidth > given.tasks[b].bandwidth; });
    for (size_t i = 0; i < order.size(); ++i) {
      const NlMeansTask& task = given.tasks[order[i]];
      const bool is_half = i > 0 && given.tasks[order[i - 1]].bandwidth == 2 * task.bandwidth;
      s.scales.push_back(is_half ? 0 : -kLog2E / (kOfPatch * task.bandwidth * task.bandwidth));
      for (const Image* image : task.sources) {
        auto source =
            std::find_if(s.sources.begin(), s.sources.end(), [&](auto& other) { return other.image == image; });
        if (source == s.sources.end()) source = s.sources.insert(source, {image, {}});
        source->uses.push_back({i, kSums * n_totals_});
        results_[first_result[order[i]]++] = {kSums * n_totals_++, image};
      }
    }
    n_weights_ = std::max(n_weights_, order.size());
  }

  float* totals(Buffers& b, int y) const { return b.totals.data() + y * kSums * n_totals_ * kRow; }

  [[gnu::noinline]] void filter_tile(const Tile& tile, Buffers& b) {
    const FlushTiny flush;
    b.weights.resize(n_weights_), copy_tile(tile, b);
    b.totals.resize(tile.height * kSums * n_totals_ * kRow);
    for (int y = 0; y < tile.height; ++y) add_own(tile, y, b);
    const int max_x = std::min(kNlMeansRadius, width_ - 1), max_y = std::min(kNlMeansRadius, height_ - 1);
    for (int band = std::max(-kNlMeansRadius, -tile.y - wanted_.first_row); band < tile.height; band += kBand)
      for (int dy = 0; dy <= max_y && wanted_.any(tile.y + band, tile.y + band + kBand + max_y); ++dy) {
        const int first = std::max({band, -dy, -tile.y});
        const int end = std::min({band + kBand, tile.height, height_ - tile.y - dy});
        if (first >= end) continue;
        for (int dx = dy == 0 ? 1 : -max_x; dx <= max_x; dx += kAtOnce)
          add_pairs(tile, first, end, {dx, dy, std::min(kAtOnce, max_x + 1 - dx)}, b);
      }
    for (int y = std::max({0, -tile.y, wanted_.first - tile.y}); y < std::min(tile.height, wanted_.end - tile.y); ++y)
      finish(tile, y, totals(b, y));
  }

  void copy_tile(const Tile& tile, Buffers& b) const {
    b.planes.resize(steerings_.size());
    for (size_t i = 0; i < steerings_.size(); ++i) {
      const Steering& s = steerings_[i];
      Planes& planes = b.planes[i];
      if (planes.count() != s.n_planes()) planes = Planes(kTileWidth, kTileHeight, s.n_planes(), kBorder, 0);
      COVARY_CHECK(planes.row(1, 0) - planes.row(0, 0) == kPlane && planes.stride() == kStride, "as assumed");
      copy_around(tile, *s.std_error, true, 3, planes);
      for (size_t k = 0; k < s.sources.size(); ++k)
        copy_around(tile, *s.sources[k].image, false, Steering::first_plane(k), planes);
    }
    b.mask = Planes(tile.width, tile.height, 1, kBorder, 0);
    for (int y = std::max(-kBorder, -tile.y); y < std::min(tile.height + kBorder, height_ - tile.y); ++y)
      for (int x = std::max(-kBorder, -tile.x); x < std::min(tile.width + kBorder, width_ - tile.x); ++x)
        b.mask.row(0, y)[x] = valid_[static_cast<size_t>(tile.y + y) * width_ + tile.x + x];
  }

  /// Adds the pixels themselves, with weight 1.
  void add_own(const Tile& tile, int y, Buffers& b) const {
    const float* const mask = b.mask.row(0, y);
    for (size_t i = 0; i < steerings_.size(); ++i)
      for (size_t k = 0; k < steerings_[i].sources.size(); ++k)
        for (const Source::Use& use : steerings_[i].sources[k].uses) {
          float* const total = totals(b, y) + use.total * kRow;
          for (int c = 0; c < 3; ++c) {
            const float* const values = b.planes[i].row(Steering::first_plane(k) + c, y);
            for (int x = 0; x < tile.width; ++x) total[c * kRow + x] = mask[x] * values[x];
          }
          std::copy_n(mask, tile.width, total + 3 * kRow);
        }
  }

  /// Adds the contributions of the pairs of rows `first` to `end` - 1 to both of their pixels.
  void add_pairs(const Tile& tile, int first, int end, const Offsets& o, Buffers& b) const {
    for (int y = first; y < end; ++y)
      for (int k = 0; k < o.n; ++k) find_feature_likenesses(tile, y, o.dx + k, o.dy, k, b.features[y - first], b);
    for (size_t i = 0; i < steerings_.size(); ++i)
      for (int y = first - kPatch; y < end + kPatch; ++y) {
        const int row = y - kPatch;  // this row completes its patches
        for (int k = 0; k < o.n; ++k)
          if (row < first)
            find_weights<false>(i, tile, y, o.dx + k, o.dy, k, nullptr, b);
          else
            find_weights<true>(i, tile, y, o.dx + k, o.dy, k, b.features[row - first].data(), b);
        if (row < first) continue;
        if (row >= 0) add_row(i, tile, row + o.dy, o, 1, totals(b, row), b);
        if (row + o.dy < tile.height) add_row(i, tile, row, o, -1, totals(b, row + o.dy), b);
      }
  }

  void find_feature_likenesses(const Tile& tile, int y, int dx, int dy, int k, std::array<Rows, 2>& likenesses,
                               const Buffers& b) const {
    const int left = tile.left(dx), n = tile.n_pairs(dx), count = features_ ? features_->count() : 0;
    const float* const features = features_ ? features_->row(0, tile.y + y) + tile.x + left : nullptr;
    const ptrdiff_t plane = count > 1 ? features_->row(1, 0) - features_->row(0, 0) : 0;
    const ptrdiff_t there = features_ ? dy * features_->stride() + dx : 0;
    const float *own_mask = b.mask.row(0, y) + left, *other_mask = b.mask.row(0, y + dy) + left + dx;
    float *forward = likenesses[0][k].begin(), *backward = likenesses[1][k].begin();
    for (int x = 0; x < n; x += kLanes) {
      vfloat sum = {};
      const float* q = features + x;
      for (int i = 0; i < count; ++i, q += plane) {
        const vfloat difference = load(q) - load(q + there);
        sum = fma(difference, difference, sum);
      }
      const vfloat likeness = exp2_of_nonpositive(sum * -kLog2E);
      store(forward + x, likeness * load(other_mask + x));
      store(backward + x, likeness * load(own_mask + x));
    }
  }

  /// For offset number k: distances of the pairs of row y, and from these and the two previous rows the weights of row
  /// y - 1.
  template <bool with_weights>
  [[gnu::noinline]] void find_weights(size_t steering, const Tile& tile, int y, int dx, int dy, int k,
                                      const Rows* features, Buffers& b) const {
    const Planes& planes = b.planes[steering];
    const int left = tile.left(dx), n = tile.n_pairs(dx);
    const ptrdiff_t there = dy * kStride + dx;
    const float *f = planes.row(0, y) + left - kPatch, *variance = planes.row(3, y) + left - kPatch;
    const float* const feature[] = {with_weights ? features[0][k].begin() : nullptr,
                                    with_weights ? features[1][k].begin() : nullptr};
    float *before[2], *before_that[2], *weights[2];
    for (const int i : {0, 1}) {
      before[i] = b.pair_sums[(y + 1) & 1][i][k].begin();
      before_that[i] = b.pair_sums[y & 1][i][k].begin();
      weights[i] = b.weights[0][i][k].begin();
    }
    constexpr size_t kTask = sizeof(b.weights[0]) / sizeof(float);
    const float* const scales = steerings_[steering].scales.data();
    const size_t n_tasks = steerings_[steering].scales.size();
    PairSums pixels = pixel_sums(f, variance, there);
    for (int x = 0; x < n; x += kLanes) {
      const int next_x = x + kLanes;
      PairSums next = pixels;
      if (next_x < n + 2 * kPatch) next = pixel_sums(f + next_x, variance + next_x, there);
      const vfloat sums[] = {sum_of_three(pixels.a, next.a), sum_of_three(pixels.b, next.b)};
      if constexpr (with_weights) {
        const vfloat of_features[] = {load(feature[0] + x), load(feature[1] + x)};
        const vfloat A = load(before_that[0] + x) + load(before[0] + x) + sums[0],
                     B = load(before_that[1] + x) + load(before[1] + x) + sums[1];
        const vfloat distances[] = {A - B, A + (B - kOfPatch)};
        vfloat likenesses[2];
        for (size_t i = 0; i < n_tasks; ++i)
          for (const int direction : {0, 1}) {
            vfloat& likeness = likenesses[direction];
            if (i > 0 && scales[i] == 0) {  // exp(-4 d) = exp(-d)^4
              likeness *= likeness;
              likeness *= likeness;
            } else {
              likeness = exp2_of_nonpositive(min(distances[direction] * scales[i], vfloat{}));
            }
            store(weights[direction] + i * kTask + x, min(likeness, of_features[direction]));
          }
      }
      for (const int i : {0, 1}) store(before_that[i] + x, sums[i]);
      pixels = next;
    }
  }

  /// Adds the pixels of row `from` to the totals of another row: those at the offsets from its pixels, or at the
  /// opposite offsets (sign -1).
  void add_row(size_t steering, const Tile& tile, int from, const Offsets& o, int sign, float* total,
               const Buffers& b) const {
    const Planes& planes = b.planes[steering];
    const std::vector<Source>& sources = steerings_[steering].sources;
    for (size_t k = 0; k < sources.size(); ++k) {
      const float* const values = planes.row(Steering::first_plane(k), from) + sign * o.dx;
      const std::vector<Source::Use>& uses = sources[k].uses;
      size_t i = 0;
      for (; i + 1 < uses.size(); i += 2) add_values<2>(values, tile.width, o, sign, &uses[i], total, b);
      if (i < uses.size()) add_values<1>(values, tile.width, o, sign, &uses[i], total, b);
    }
  }

  /// Same, for the weights of n tasks.
  template <int n>
  [[gnu::noinline]] void add_values(const float* values, int width, const Offsets& o, int sign, const Source::Use* uses,
                                    float* total, const Buffers& b) const {
    const auto& of_first = b.weights[uses[0].task][sign > 0 ? 0 : 1];
    const float* weights[kAtOnce];  // of the first task at column 0, and the distances from there to those of each
    for (int k = 0; k < o.n; ++k) weights[k] = of_first[k].begin() + std::max(0, sign * (o.dx + k));
    float* sums[n];
    ptrdiff_t place[n];
    for (int i = 0; i < n; ++i) {
      sums[i] = total + uses[i].total * kRow;
      place[i] = b.weights[uses[i].task][sign > 0 ? 0 : 1][0].begin() - of_first[0].begin();
    }
    for (int x = 0; x < width; x += kLanes) {
      vfloat sum[n][kSums];
      for (int i = 0; i < n; ++i)
        for (int c = 0; c < kSums; ++c) sum[i][c] = load(sums[i] + c * kRow + x);
      for (int k = 0; k < o.n; ++k) {
        vfloat weight[n];
        for (int i = 0; i < n; ++i) {
          weight[i] = load(weights[k] + (x + place[i]));
          keep_in_register(weight[i]);
          sum[i][3] += weight[i];
        }
        for (int c = 0; c < 3; ++c) {
          vfloat value = load(values + c * kPlane + sign * k + x);
          keep_in_register(value);
          for (int i = 0; i < n; ++i) sum[i][c] = fma(weight[i], value, sum[i][c]);
        }
      }
      for (int i = 0; i < n; ++i)
        for (int c = 0; c < kSums; ++c) store(sums[i] + c * kRow + x, sum[i][c]);
    }
  }

  void finish(const Tile& tile, int y, const float* total) {
    for (size_t i = 0; i < results_.size(); ++i) {
      const float *sums = total + results_[i].total * kRow, *weights = sums + 3 * kRow;
      for (int x = 0; x < tile.width; ++x)
        for (int c = 0; c < 3; ++c)
          images_[i].pixel(tile.x + x, tile.y + y)[c] =
              weights[x] > 0 ? sums[c * kRow + x] / weights[x] : results_[i].source->pixel(tile.x + x, tile.y + y)[c];
    }
  }

  const int width_, height_;
  const WantedRows wanted_;
  const Planes* features_;
  const std::vector<unsigned char>& valid_;
  std::vector<Steering> steerings_;
  size_t n_totals_ = 0, n_weights_ = 0;
  std::vector<Result> results_;
  std::vector<Image> images_;
};

}  // namespace

std::vector<Image> nl_means(std::span<const NlMeansSteering> steerings, const Planes* features,
                            const std::vector<unsigned char>& valid, const WantedRows& wanted) {
  return Filter(steerings, features, valid, wanted).run();
}

}  // namespace covary
