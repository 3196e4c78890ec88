// SPDX-License-Identifier: Apache-2.0
// Tiles of the image in parallel; in a tile a few offsets o = j - i after the other, for which the distances of all
// patches are a box filter of the distances of pixels. All loops run along rows. The pair of pixels (p, p + o) tells
// the weight of p + o for p, `forward`, and of p for p + o, `backward`: both have the same distance of guides and the
// same quotient. So half of all offsets are enough, if pairs are looked at that reach into the tile from outside.
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
constexpr int kTileWidth = 128 - 2 * kPatch, kTileHeight = 32;
constexpr int kBorder = kNlMeansRadius + kPatch;
/// Offsets whose pixels are added together, each in both directions.
constexpr int kAtOnce = 3;
/// Errors below this are taken for none; squared errors above that for it.
constexpr float kSmallestVariance = 1e-10f, kLargestVariance = 1e30f;

/// The channels of an image, continued beyond its frame by its outermost pixels.
Planes continued(const Image& image, bool is_error) {
  Planes planes(image.width, image.height, 3, kBorder, 0);
  parallel_for(image.height + 2 * kBorder, 8, [&](int row) {
    const int y = std::clamp(row - kBorder, 0, image.height - 1);
    for (int x = -kBorder; x < image.width + kBorder; ++x) {
      const float* value = image.pixel(std::clamp(x, 0, image.width - 1), y);
      for (int c = 0; c < 3; ++c)
        planes.row(c, row - kBorder)[x] = is_error ? std::min(value[c] * value[c], kLargestVariance) : value[c];
    }
  });
  return planes;
}

/// The channels of an image; 0 outside and at pixels that are not valid.
Planes masked(const Image& image, const std::vector<unsigned char>& valid) {
  Planes planes(image.width, image.height, 3, kBorder, 0);
  parallel_for(image.height, 8, [&](int y) {
    for (int x = 0; x < image.width; ++x)
      if (valid[static_cast<size_t>(y) * image.width + x])
        for (int c = 0; c < 3; ++c) planes.row(c, y)[x] = image.pixel(x, y)[c];
  });
  return planes;
}

/// One plane: 1 at valid pixels, 0 elsewhere and outside.
Planes mask_of(const std::vector<unsigned char>& valid, int width, int height) {
  Planes mask(width, height, 1, kBorder, 0);
  for (int y = 0; y < height; ++y) std::copy_n(valid.data() + static_cast<size_t>(y) * width, width, mask.row(0, y));
  return mask;
}

/// Distances of n pixels in a row from those `there` floats on, and theirs from these, summed over three planes.
void pixel_distances(const float* f, const float* variance, ptrdiff_t plane, ptrdiff_t there, int n,
                     float* __restrict forward, float* __restrict backward) {
  for (int x = 0; x < n; x += kLanes) {
    vfloat of_pixel = {}, of_other = {};
    for (int c = 0; c < 3; ++c) {
      const float *here = f + c * plane + x, *own = variance + c * plane + x;
      const vfloat difference = load(here) - load(here + there), v = load(own), u = load(own + there);
      const vfloat quotient = 1 / (v + u + kSmallestVariance), rest = difference * difference - min(v, u);
      of_pixel += (rest - v) * quotient;
      of_other += (rest - u) * quotient;
    }
    store(forward + x, of_pixel);
    store(backward + x, of_other);
  }
}

/// Rows of floats around a tile, with room for whole vectors.
struct Rows {
  static constexpr int kStride = kTileWidth + 2 * kBorder + 2 * kLanes;
  std::vector<float> data = std::vector<float>(static_cast<size_t>(kTileHeight + 2 * kBorder) * kStride, 0.0f);
  /// Column 0 of row y of the tile.
  float* row(int y) { return data.data() + static_cast<size_t>(y + kBorder) * kStride + kBorder; }
  const float* row(int y) const { return data.data() + static_cast<size_t>(y + kBorder) * kStride + kBorder; }
};

/// A tile, and the pixels p of pairs (p, p + (dx, dy)) that touch it, counted from its corner.
struct Tile {
  int x, y, width, height;

  int left(int dx) const { return std::min(0, -dx); }
  int right(int dx) const { return width + std::max(0, -dx); }
  int top(int dy) const { return -dy; }
};

/// An image that steers, with what is averaged by it.
struct Steering {
  Planes f, variance;
  std::vector<size_t> order;  // of tasks, from the widest to the narrowest
  std::vector<Planes> sources;
  std::vector<size_t> first_source;  // of each task
};

class Filter {
 public:
  Filter(std::span<const NlMeansSteering> steerings, const Planes* guides, const std::vector<unsigned char>& valid)
      : width_(steerings[0].image->width),
        height_(steerings[0].image->height),
        guides_(guides),
        mask_(mask_of(valid, width_, height_)),
        given_(steerings) {
    COVARY_CHECK(!guides_ || guides_->border() >= kNlMeansRadius, "guides have the border that NL-means reads");
    for (const NlMeansSteering& given : given_) {
      Steering steering{continued(*given.image, false), continued(*given.std_error, true), {}, {}, {}};
      for (const NlMeansTask& task : given.tasks) {
        steering.first_source.push_back(steering.sources.size());
        for (const Image* source : task.sources) steering.sources.push_back(masked(*source, valid));
        n_sums_ += 1 + 3 * task.sources.size();
      }
      results_.resize(results_.size() + steering.sources.size(), Image(width_, height_, 3));
      steering.order.resize(given.tasks.size());
      std::iota(steering.order.begin(), steering.order.end(), 0);
      std::sort(steering.order.begin(), steering.order.end(),
                [&](size_t a, size_t b) { return given.tasks[a].bandwidth > given.tasks[b].bandwidth; });
      steerings_.push_back(std::move(steering));
    }
  }

  std::vector<Image> run() {
    const int columns = (width_ + kTileWidth - 1) / kTileWidth, rows = (height_ + kTileHeight - 1) / kTileHeight;
    parallel_for(columns * rows, [&](int number) {
      const int x = number % columns * kTileWidth, y = number / columns * kTileHeight;
      filter_tile({x, y, std::min(kTileWidth, width_ - x), std::min(kTileHeight, height_ - y)});
    });
    return std::move(results_);
  }

 private:
  using Row = std::array<float, Rows::kStride>;
  /// What is done at once for kAtOnce offsets: sums that are read and written once for all.
  struct Buffers {
    Row pixels[2];
    std::array<Rows, kAtOnce> forward, backward;       // distances of pixels, summed over the columns of patches
    std::array<Rows, kAtOnce> guides;                  // exp(-||q_p - q_(p + o)||^2)
    std::array<Row, 2 * kAtOnce> likenesses, weights;  // of offset k forward, 2 k, and backward, 2 k + 1
    std::vector<Rows> totals;                          // per task its weights, per source three channels
  };

  /// Distances of the pixels of all pairs that touch the tile, summed over the columns of patches.
  void column_sums(const Steering& s, const Tile& tile, int dx, int dy, int k, Buffers& b) const {
    const ptrdiff_t plane = s.f.row(1, 0) - s.f.row(0, 0), there = dy * s.f.stride() + dx;
    const int left = tile.left(dx), n = tile.right(dx) - left;
    float *forward = b.pixels[0].data(), *backward = b.pixels[1].data();
    for (int y = tile.top(dy) - kPatch; y < tile.height + kPatch; ++y) {
      const ptrdiff_t first = s.f.row(0, tile.y + y) + tile.x + left - kPatch - s.f.row(0, 0);
      pixel_distances(s.f.row(0, 0) + first, s.variance.row(0, 0) + first, plane, there, n + 2 * kPatch, forward,
                      backward);
      float *sums = b.forward[k].row(y) + left, *other_sums = b.backward[k].row(y) + left;
      for (int x = 0; x < n; x += kLanes) {
        store(sums + x, load(forward + x) + load(forward + x + 1) + load(forward + x + 2));
        store(other_sums + x, load(backward + x) + load(backward + x + 1) + load(backward + x + 2));
      }
    }
  }

  void guide_likenesses(const Tile& tile, int dx, int dy, Rows& likenesses) const {
    for (int y = tile.top(dy); y < tile.height; ++y) {
      float* row = likenesses.row(y);
      const size_t x0 = static_cast<size_t>(tile.x);
      for (int x = tile.left(dx); x < tile.right(dx); x += kLanes) {
        vfloat sum = {};
        for (int i = 0; guides_ && i < guides_->count(); ++i) {
          const vfloat difference =
              load(guides_->row(i, tile.y + y) + x0 + x) - load(guides_->row(i, tile.y + y + dy) + x0 + dx + x);
          sum += difference * difference;
        }
        store(row + x, exp2_of_nonpositive(sum * -kLog2E));
      }
    }
  }

  void filter_tile(const Tile& tile) {
    const FlushTiny flush;
    thread_local Buffers b;
    b.totals.resize(n_sums_);
    for (Rows& total : b.totals) std::fill(total.data.begin(), total.data.end(), 0.0f);
    for (int y = 0; y < tile.height; ++y) add_own(tile, y, b);
    const int most_x = std::min(kNlMeansRadius, width_ - 1), most_y = std::min(kNlMeansRadius, height_ - 1);
    for (int dy = 0; dy <= most_y; ++dy)
      for (int dx = dy == 0 ? 1 : -most_x; dx <= most_x; dx += kAtOnce) {
        const int n = std::min(kAtOnce, most_x + 1 - dx);
        for (int k = 0; k < n; ++k) guide_likenesses(tile, dx + k, dy, b.guides[k]);
        size_t total = 0;
        for (const Steering& s : steerings_) {
          for (int k = 0; k < n; ++k) column_sums(s, tile, dx + k, dy, k, b);
          for (int y = 0; y < tile.height; ++y) {
            if (n == kAtOnce)
              add_row<kAtOnce>(s, tile, y, dx, dy, b, 0, total);
            else
              for (int k = 0; k < n; ++k) add_row<1>(s, tile, y, dx + k, dy, b, k, total);
          }
          total += s.order.size() + 3 * s.sources.size();
        }
      }
    for (int y = 0; y < tile.height; ++y)
      for (int x = 0; x < tile.width; ++x) finish(tile, x, y, b);
  }

  /// The pixels themselves, whose weight is 1.
  void add_own(const Tile& tile, int y, Buffers& b) const {
    size_t total = 0;
    for (size_t i = 0; i < steerings_.size(); ++i)
      for (size_t t = 0; t < given_[i].tasks.size(); ++t) {
        std::copy_n(mask_.row(0, tile.y + y) + tile.x, tile.width, b.totals[total++].row(y));
        for (size_t source = 0; source < given_[i].tasks[t].sources.size(); ++source)
          for (int c = 0; c < 3; ++c)
            std::copy_n(steerings_[i].sources[steerings_[i].first_source[t] + source].row(c, tile.y + y) + tile.x,
                        tile.width, b.totals[total++].row(y));
      }
  }

  /// exp(-max(d, 0) / k^2) for the pixels at n offsets from (dx, dy) on, which are number `first` ... of the buffers,
  /// and at the opposite ones.
  template <int n>
  void find_likenesses(float bandwidth, const Tile& tile, int y, int dx, int dy, Buffers& b, int first) const {
    const float scale = -kLog2E / (9 * 3 * bandwidth * bandwidth);
    for (int k = 0; k < n; ++k)
      for (int direction : {0, 1}) {
        const Rows& sums = (direction == 0 ? b.forward : b.backward)[first + k];
        const float* here = direction == 0 ? sums.row(y) : sums.row(y - dy) - (dx + k);
        float* row = b.likenesses[2 * k + direction].data();
        for (int x = 0; x < tile.width; x += kLanes) {
          const vfloat sum = load(here + x - Rows::kStride) + load(here + x) + load(here + x + Rows::kStride);
          store(row + x, exp2_of_nonpositive(min(sum * scale, vfloat{})));
        }
      }
  }

  /// Adds the pixels at n offsets from (dx, dy) on, and at the opposite ones, to the sums of row y, from number
  /// `first_total` on.
  template <int n>
  void add_row(const Steering& s, const Tile& tile, int y, int dx, int dy, Buffers& b, int first,
               size_t first_total) const {
    const std::vector<NlMeansTask>& tasks = given_[static_cast<size_t>(&s - steerings_.data())].tasks;
    float before = 0;
    for (const size_t t : s.order) {
      const float bandwidth = tasks[t].bandwidth;
      const bool is_half = before == 2 * bandwidth;  // exp(-4 d) = exp(-d)^4
      if (!is_half && before != bandwidth) find_likenesses<n>(bandwidth, tile, y, dx, dy, b, first);
      before = bandwidth;
      size_t total = first_total + t + 3 * s.first_source[t];
      add_weights<n>(tile, y, dx, dy, is_half, b, first, b.totals[total++].row(y));
      for (size_t i = 0; i < tasks[t].sources.size(); ++i, total += 3)
        add_values<n>(s.sources[s.first_source[t] + i], tile, y, dx, dy, b, &b.totals[total]);
    }
  }

  template <int n>
  void add_weights(const Tile& tile, int y, int dx, int dy, bool to_fourth, Buffers& b, int first, float* total) const {
    const float *guides[2 * n], *there = mask_.row(0, tile.y + y + dy) + tile.x + dx,
                                *back = mask_.row(0, tile.y + y - dy) + tile.x - dx;
    for (int k = 0; k < n; ++k)
      guides[2 * k] = b.guides[first + k].row(y), guides[2 * k + 1] = b.guides[first + k].row(y - dy) - dx - k;
    for (int x = 0; x < tile.width; x += kLanes) {
      vfloat sum = load(total + x);
      for (int m = 0; m < 2 * n; ++m) {
        vfloat likeness = load(b.likenesses[m].data() + x);
        if (to_fourth) {
          likeness *= likeness;
          likeness *= likeness;
          store(b.likenesses[m].data() + x, likeness);
        }
        const vfloat weight = min(likeness, load(guides[m] + x));
        store(b.weights[m].data() + x, weight);
        sum += weight * load(m % 2 == 0 ? there + m / 2 + x : back - m / 2 + x);
      }
      store(total + x, sum);
    }
  }

  template <int n>
  void add_values(const Planes& source, const Tile& tile, int y, int dx, int dy, const Buffers& b, Rows* totals) const {
    const ptrdiff_t plane = source.row(1, 0) - source.row(0, 0);
    const float *there = source.row(0, tile.y + y + dy) + tile.x + dx,
                *back = source.row(0, tile.y + y - dy) + tile.x - dx, *weights = b.weights[0].data();
    float* const sums[] = {totals[0].row(y), totals[1].row(y), totals[2].row(y)};
    for (int x = 0; x < tile.width; x += kLanes) {
      vfloat sum[3];
      for (int c = 0; c < 3; ++c) sum[c] = load(sums[c] + x);
      for (int k = 0; k < n; ++k) {
        const vfloat forward = load(weights + 2 * k * Rows::kStride + x);
        const vfloat backward = load(weights + (2 * k + 1) * Rows::kStride + x);
        for (int c = 0; c < 3; ++c) {
          sum[c] += forward * load(there + c * plane + k + x);
          sum[c] += backward * load(back + c * plane - k + x);
        }
      }
      for (int c = 0; c < 3; ++c) store(sums[c] + x, sum[c]);
    }
  }

  void finish(const Tile& tile, int x, int y, Buffers& b) {
    size_t total = 0, result = 0;
    for (const NlMeansSteering& given : given_)
      for (const NlMeansTask& task : given.tasks) {
        const float weight = b.totals[total++].row(y)[x];
        for (const Image* source : task.sources) {
          float* to = results_[result++].pixel(tile.x + x, tile.y + y);
          for (int c = 0; c < 3; ++c) {
            const float sum = b.totals[total++].row(y)[x];
            to[c] = weight > 0 ? sum / weight : source->pixel(tile.x + x, tile.y + y)[c];
          }
        }
      }
  }

  const int width_, height_;
  const Planes* guides_;
  const Planes mask_;
  const std::span<const NlMeansSteering> given_;
  std::vector<Steering> steerings_;
  size_t n_sums_ = 0;
  std::vector<Image> results_;
};

}  // namespace

std::vector<Image> nl_means(std::span<const NlMeansSteering> steerings, const Planes* guides,
                            const std::vector<unsigned char>& valid) {
  return Filter(steerings, guides, valid).run();
}

}  // namespace covary
