// SPDX-License-Identifier: Apache-2.0
// Tiles of the image in parallel; in a tile a few offsets j - i after the other, for which the distances of all patches
// are a box filter of the distances of pixels. All loops run along rows.
#include "filters/nl_means.h"

#include <algorithm>
#include <array>

#include "core/error.h"
#include "core/parallel.h"

namespace covary {
namespace {

using namespace lanes;

constexpr int kPatch = 1;  // radius
constexpr int kTileWidth = 128 - 2 * kPatch, kTileHeight = 16;
constexpr int kBorder = kNlMeansRadius + kPatch;
/// Offsets whose pixels are added together.
constexpr int kAtOnce = 3;
/// Errors below this are taken for none.
constexpr float kSmallestVariance = 1e-10f;

/// The channels of an image, continued beyond its frame by its outermost pixels.
Planes continued(const Image& image, bool squared) {
  Planes planes(image.width, image.height, 3, kBorder, 0);
  parallel_for(image.height + 2 * kBorder, 8, [&](int row) {
    const int y = std::clamp(row - kBorder, 0, image.height - 1);
    for (int x = -kBorder; x < image.width + kBorder; ++x) {
      const float* value = image.pixel(std::clamp(x, 0, image.width - 1), y);
      for (int c = 0; c < 3; ++c) planes.row(c, row - kBorder)[x] = squared ? value[c] * value[c] : value[c];
    }
  });
  return planes;
}

/// One plane: 1 at valid pixels, 0 elsewhere and outside.
Planes mask_of(const std::vector<unsigned char>& valid, int width, int height) {
  Planes mask(width, height, 1, kBorder, 0);
  for (int y = 0; y < height; ++y) std::copy_n(valid.data() + static_cast<size_t>(y) * width, width, mask.row(0, y));
  return mask;
}

/// Rows of floats around a tile, `kPatch` rows and columns more on each side and room for whole vectors.
struct Rows {
  static constexpr int kStride = kTileWidth + 2 * kPatch + 2 * kLanes;
  std::vector<float> data = std::vector<float>(static_cast<size_t>(kTileHeight + 2 * kPatch) * kStride, 0.0f);
  /// Column 0 of row y of the tile.
  float* row(int y) { return data.data() + static_cast<size_t>(y + kPatch) * kStride + kPatch; }
};

class Filter {
 public:
  Filter(const NlMeansSteering& steering, std::span<const NlMeansTask> tasks)
      : width_(steering.image->width),
        height_(steering.image->height),
        guides_(steering.guides),
        f_(continued(*steering.image, false)),
        variance_(continued(*steering.std_error, true)),
        mask_(mask_of(*steering.valid, width_, height_)),
        tasks_(tasks) {
    COVARY_CHECK(!guides_ || guides_->border() >= kNlMeansRadius, "guides have the border that NL-means reads");
    for (const NlMeansTask& task : tasks)
      for (const Image* source : task.sources) {
        sources_.push_back(continued(*source, false));
        results_.emplace_back(width_, height_, 3);
      }
  }

  std::vector<Image> run() {
    const int columns = (width_ + kTileWidth - 1) / kTileWidth, rows = (height_ + kTileHeight - 1) / kTileHeight;
    parallel_for(columns * rows,
                 [&](int tile) { filter_tile(tile % columns * kTileWidth, tile / columns * kTileHeight); });
    return std::move(results_);
  }

 private:
  /// What is done at once for kAtOnce offsets (dx + i, dy): sums that are read and written once for all.
  struct Buffers {
    Rows pixels;
    std::array<Rows, kAtOnce> sums;
    std::array<std::array<float, Rows::kStride>, kAtOnce> guides, weights;
    std::vector<Rows> totals;  // per task its weights, per source three channels
  };

  /// Distances of the pixels of a row of the tile and its border from those at (dx, dy), summed over RGB.
  void pixel_distances(int x0, int y, int n_columns, int dx, int dy, float* row) const {
    const float *f[3], *f_there[3], *own[3], *other[3];
    for (int c = 0; c < 3; ++c) {
      f[c] = f_.row(c, y) + x0, f_there[c] = f_.row(c, y + dy) + x0 + dx;
      own[c] = variance_.row(c, y) + x0, other[c] = variance_.row(c, y + dy) + x0 + dx;
    }
    for (int x = -kPatch; x < n_columns + kPatch; x += kLanes) {
      vfloat sum = {};
      for (int c = 0; c < 3; ++c) {
        const vfloat difference = load(f[c] + x) - load(f_there[c] + x), a = load(own[c] + x), b = load(other[c] + x);
        sum += (difference * difference - (a + min(a, b))) / (a + b + kSmallestVariance);
      }
      store(row + x, sum);
    }
  }

  /// The same for the tile at (x0, y0), summed over the columns of patches.
  void column_sums(int x0, int y0, int n_columns, int n_rows, int dx, int dy, Rows& pixels, Rows& sums) const {
    for (int y = -kPatch; y < n_rows + kPatch; ++y) {
      float* row = pixels.row(y);
      pixel_distances(x0, y0 + y, n_columns, dx, dy, row);
      for (int x = 0; x < n_columns; x += kLanes)
        store(sums.row(y) + x, load(row + x - 1) + load(row + x) + load(row + x + 1));
    }
  }

  /// Distances of the guides of a row from those at (dx, dy).
  void guide_distances(int x0, int y, int n_columns, int dx, int dy, float* row) const {
    std::fill_n(row, n_columns + kLanes, 0.0f);
    for (int i = 0; guides_ && i < guides_->count(); ++i) {
      const float *here = guides_->row(i, y) + x0, *there = guides_->row(i, y + dy) + x0 + dx;
      for (int x = 0; x < n_columns; x += kLanes) {
        const vfloat difference = load(here + x) - load(there + x);
        store(row + x, load(row + x) + difference * difference);
      }
    }
  }

  void filter_tile(int x0, int y0) {
    thread_local Buffers b;
    b.totals.resize(tasks_.size() + 3 * sources_.size());
    for (Rows& total : b.totals) std::fill(total.data.begin(), total.data.end(), 0.0f);
    const int n_columns = std::min(kTileWidth, width_ - x0), n_rows = std::min(kTileHeight, height_ - y0);
    const int most_x = std::min(kNlMeansRadius, width_ - 1), most_y = std::min(kNlMeansRadius, height_ - 1);
    for (int dy = -most_y; dy <= most_y; ++dy)
      for (int dx = -most_x; dx <= most_x; dx += kAtOnce) {
        const int n = std::min(kAtOnce, most_x + 1 - dx);
        for (int i = 0; i < n; ++i) column_sums(x0, y0, n_columns, n_rows, dx + i, dy, b.pixels, b.sums[i]);
        for (int y = 0; y < n_rows; ++y) {
          for (int i = 0; i < n; ++i) guide_distances(x0, y0 + y, n_columns, dx + i, dy, b.guides[i].data());
          if (n == kAtOnce)
            add_row<kAtOnce>(x0, y0, y, n_columns, dx, dy, b);
          else
            for (int i = 0; i < n; ++i) add_row<1>(x0, y0, y, n_columns, dx + i, dy, b, i);
        }
      }
    for (int y = 0; y < n_rows; ++y)
      for (int x = 0; x < n_columns; ++x) finish(x, y, x0, y0, b.totals);
  }

  /// Adds the pixels at n offsets from (dx, dy) on, which are number `first` … of the buffers, to the sums of row y.
  template <int n>
  void add_row(int x0, int y0, int y, int n_columns, int dx, int dy, Buffers& b, int first = 0) const {
    size_t total = 0, source = 0;
    const float* mask = mask_.row(0, y0 + y + dy) + x0 + dx;
    for (const NlMeansTask& task : tasks_) {
      add_weights<n>(task.bandwidth, mask, y, n_columns, first, b, b.totals[total++].row(y));
      for (size_t i = 0; i < 3 * task.sources.size(); ++i) {
        const float* values = sources_[source + i / 3].row(static_cast<int>(i % 3), y0 + y + dy) + x0 + dx;
        float* sums = b.totals[total++].row(y);
        for (int x = 0; x < n_columns; x += kLanes) {
          vfloat sum = load(sums + x);
          for (int k = 0; k < n; ++k) sum += load(b.weights[k].data() + x) * load(values + k + x);
          store(sums + x, sum);
        }
      }
      source += task.sources.size();
    }
  }

  template <int n>
  void add_weights(float bandwidth, const float* mask, int y, int n_columns, int first, Buffers& b,
                   float* total) const {
    const float inverse = 1 / (bandwidth * bandwidth);
    for (int x = 0; x < n_columns; x += kLanes) {
      vfloat sum = load(total + x);
      for (int k = 0; k < n; ++k) {
        Rows& sums = b.sums[first + k];
        const vfloat distance =
            (load(sums.row(y - 1) + x) + load(sums.row(y) + x) + load(sums.row(y + 1) + x)) * (1.0f / 27.0f);
        const vfloat exponent = max(max(distance * inverse, load(b.guides[first + k].data() + x)), vfloat{});
        const vfloat weight = load(mask + k + x) * exp_of_nonpositive(-exponent);
        store(b.weights[k].data() + x, weight);
        sum += weight;
      }
      store(total + x, sum);
    }
  }

  void finish(int x, int y, int x0, int y0, std::vector<Rows>& totals) {
    size_t total = 0, source = 0;
    for (const NlMeansTask& task : tasks_) {
      const float weight = totals[total++].row(y)[x];
      for (size_t i = 0; i < task.sources.size(); ++i, ++source)
        for (int c = 0; c < 3; ++c) {
          const float sum = totals[total++].row(y)[x];
          results_[source].pixel(x0 + x, y0 + y)[c] =
              weight > 0 ? sum / weight : sources_[source].row(c, y0 + y)[x0 + x];
        }
    }
  }

  const int width_, height_;
  const Planes* guides_;
  const Planes f_, variance_, mask_;
  const std::span<const NlMeansTask> tasks_;
  std::vector<Planes> sources_;
  std::vector<Image> results_;
};

}  // namespace

std::vector<Image> nl_means(const NlMeansSteering& steering, std::span<const NlMeansTask> tasks) {
  return Filter(steering, tasks).run();
}

}  // namespace covary
