// SPDX-License-Identifier: Apache-2.0
// Tiles of the image in parallel; in a tile one offset j - i after the other, for which the distances of all patches
// are a box filter of the distances of pixels.
#include "estimators/nl_means.h"

#include <algorithm>

#include "core/error.h"
#include "core/parallel.h"

namespace covary {
namespace {

using namespace lanes;

constexpr int kPatch = 1;  // radius
constexpr int kTileWidth = 128 - 2 * kPatch, kTileHeight = 16;
constexpr int kBorder = kNlMeansRadius + kPatch;
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
  /// Distances of the pixels (x + lane, y) from those at (dx, dy), summed over RGB.
  vfloat pixel_distance(int x, int y, int dx, int dy) const {
    vfloat sum = {};
    for (int c = 0; c < 3; ++c) {
      const vfloat difference = load(f_.row(c, y) + x) - load(f_.row(c, y + dy) + x + dx);
      const vfloat own = load(variance_.row(c, y) + x), other = load(variance_.row(c, y + dy) + x + dx);
      sum += (difference * difference - (own + min(own, other))) / (own + other + kSmallestVariance);
    }
    return sum;
  }

  vfloat guide_distance(int x, int y, int dx, int dy) const {
    vfloat sum = {};
    for (int i = 0; guides_ && i < guides_->count(); ++i) {
      const vfloat difference = load(guides_->row(i, y) + x) - load(guides_->row(i, y + dy) + x + dx);
      sum += difference * difference;
    }
    return sum;
  }

  /// Distances of pixels for the tile at (x0, y0) and its border, summed over the columns of patches.
  void make_distances(int x0, int y0, int n_columns, int n_rows, int dx, int dy, Rows& pixels, Rows& sums) const {
    for (int y = -kPatch; y < n_rows + kPatch; ++y) {
      float* row = pixels.row(y);
      for (int x = -kPatch; x < n_columns + kPatch; x += kLanes) store(row + x, pixel_distance(x0 + x, y0 + y, dx, dy));
      for (int x = 0; x < n_columns; x += kLanes)
        store(sums.row(y) + x, load(row + x - 1) + load(row + x) + load(row + x + 1));
    }
  }

  void filter_tile(int x0, int y0) {
    thread_local Rows pixels, sums;
    thread_local std::vector<Rows> totals;  // per task its weights, per source three channels
    totals.resize(tasks_.size() + 3 * sources_.size());
    for (Rows& total : totals) std::fill(total.data.begin(), total.data.end(), 0.0f);
    const int n_columns = std::min(kTileWidth, width_ - x0), n_rows = std::min(kTileHeight, height_ - y0);
    for (int dy = -kNlMeansRadius; dy <= kNlMeansRadius; ++dy)
      for (int dx = -kNlMeansRadius; dx <= kNlMeansRadius; ++dx) {
        if (std::abs(dx) >= width_ || std::abs(dy) >= height_) continue;
        make_distances(x0, y0, n_columns, n_rows, dx, dy, pixels, sums);
        for (int y = 0; y < n_rows; ++y)
          for (int x = 0; x < n_columns; x += kLanes) {
            const vfloat distance =
                (load(sums.row(y - 1) + x) + load(sums.row(y) + x) + load(sums.row(y + 1) + x)) * (1.0f / 27.0f);
            add(x, y, x0 + x + dx, y0 + y + dy, distance, guide_distance(x0 + x, y0 + y, dx, dy), totals);
          }
      }
    for (int y = 0; y < n_rows; ++y)
      for (int x = 0; x < n_columns; ++x) finish(x, y, x0, y0, totals);
  }

  /// Adds the pixels at (qx + lane, qy) to the sums of those at (x + lane, y) of the tile.
  void add(int x, int y, int qx, int qy, vfloat distance, vfloat guide_distance, std::vector<Rows>& totals) const {
    const vfloat mask = load(mask_.row(0, qy) + qx);
    size_t total = 0, source = 0;
    for (const NlMeansTask& task : tasks_) {
      const vfloat exponent = max(max(distance * (1 / (task.bandwidth * task.bandwidth)), guide_distance), vfloat{});
      const vfloat weight = mask * exp_of_nonpositive(-exponent);
      const auto add_to = [&](vfloat value) {
        float* at = totals[total++].row(y) + x;
        store(at, load(at) + value);
      };
      add_to(weight);
      for (size_t i = 0; i < task.sources.size(); ++i, ++source)
        for (int c = 0; c < 3; ++c) add_to(weight * load(sources_[source].row(c, qy) + qx));
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
