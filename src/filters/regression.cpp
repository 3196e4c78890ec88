// SPDX-License-Identifier: Apache-2.0
// Lanes hold adjacent windows, whose centres are kStep pixels apart. So each plane holds every kStep-th column: plane
// kStep c + r of value `c` has the columns kStep i + r. Every band of rows accumulates its own sums, with a border;
// these are combined in the order of the bands.
#include "filters/regression.h"

#include <array>

#include "core/error.h"
#include "core/parallel.h"
#include "filters/batch_algebra.h"

namespace covary {
namespace {

using namespace lanes;

constexpr int kRadius = 10, kPatch = 1, kSide = 2 * kRadius + 1, kOffsets = kSide * kSide;
constexpr int kBorder = kRadius + kPatch;
constexpr int kBandRows = 8;  // of windows
constexpr float kBandwidth = 0.5f, kOfPatch = 27;
/// Ridges of slopes; pixels per unit of position; weight of the other image.
constexpr float kRidge = 5e-4f, kRidgeOfPosition = 1e-3f, kPlaceUnit = 6, kOfOther = 1;
constexpr float kSmallestVariance = 1e-10f, kLargestVariance = 1e30f;
/// Terms of a model: constant, columns, rows, features, position.
constexpr int kMaxTerms = 3 + kMaxFeatures + 3;

using Terms = std::array<vfloat, kMaxTerms>;
/// For pixels at all offsets in a row of windows.
using RowTerms = std::array<std::array<vfloat, kSide>, kMaxTerms>;

/// Plane and column of the pixels `dx` columns from the centres.
template <int kStep>
struct PlaceOf {
  explicit PlaceOf(int dx) : residue((1 + dx + kStep * kBorder) % kStep), column((1 + dx - residue) / kStep) {}
  int residue, column;
};

template <int kStep>
class Regression {
  using Place = PlaceOf<kStep>;

 public:
  Regression(const RegressionInput& input, std::span<const Image* const> features,
             const std::vector<unsigned char>& valid)
      : in_(input),
        valid_(valid),
        width_(input.image->width),
        height_(input.image->height),
        columns_((width_ + kStep - 1) / kStep),
        first_window_(input.wanted.first_row / kStep % kBandRows),
        n_terms_(3),
        n_sources_(static_cast<int>(input.sources.size())) {
    for (const Image* feature : features) n_terms_ += feature->channels;
    COVARY_CHECK(n_terms_ <= 3 + kMaxFeatures, "at most kMaxFeatures");
    COVARY_CHECK(input.wanted.first_row % kRegressionCell == 0, "rows begin with a row of windows");
    first_of_position_ = n_terms_;
    if (in_.position) n_terms_ += 3;
    std::vector<const Image*> images = {in_.image, in_.std_error};
    images.insert(images.end(), features.begin(), features.end());
    if (in_.position) images.push_back(in_.position);
    first_source_ = 3 + n_terms_;
    images.insert(images.end(), in_.sources.begin(), in_.sources.end());
    planes_ = Planes(columns_, height_, kStep * (first_source_ + 3 * n_sources_), kBorder, 0);
    int first = 0;
    for (const Image* image : images)
      copy(*image, image == in_.std_error && first == 3, first), first += image->channels;
    mask_ = Planes(columns_, height_, kStep, kBorder, 0);
    for (int y = 0; y < height_; ++y)
      for (int x = 0; x < width_; ++x)
        mask_.row(x % kStep, y)[x / kStep] = valid[static_cast<size_t>(y) * width_ + x] ? 1 : 0;
  }

  std::vector<Image> run() {
    // Bands are those of the whole image, so that the order of sums does not depend on the rows that are given.
    const int end = first_window_ + (height_ + kStep - 1) / kStep;
    std::vector<Planes> bands(static_cast<size_t>((end + kBandRows - 1) / kBandRows));
    parallel_for(static_cast<int>(bands.size()), [&](int number) {
      const int top = (number * kBandRows - first_window_) * kStep;
      if (!in_.wanted.any(top - kBorder, top + kBandRows * kStep + kBorder)) return;
      const FlushTiny flush;
      Planes& sums = bands[static_cast<size_t>(number)];
      sums = Planes(columns_, kBandRows * kStep, kStep * (3 * n_sources_ + 1), kBorder, 0);
      const int first = number * kBandRows;
      for (int row = std::max(first, first_window_); row < std::min(first + kBandRows, end); ++row) {
        const int y = kStep * (row - first_window_) + 1;
        if (!in_.wanted.any(y - kRadius, y + kRadius + 1)) continue;
        for (int x = 0; x < columns_; x += kLanes) add_windows(x, row - first_window_, kStep * (row - first) + 1, sums);
      }
    });
    std::vector<Image> images(static_cast<size_t>(n_sources_), Image(width_, height_, 3));
    parallel_for(height_, 16, [&](int y) {
      if (in_.wanted.any(y, y + 1)) finish(y, bands, images);
    });
    return images;
  }

 private:
  struct Windows {
    std::array<vfloat, kOffsets> roots;  // square roots of weights
    RowTerms terms;
  };

  /// The outermost pixels are repeated beyond the frame.
  void copy(const Image& image, bool is_error, int first) {
    parallel_for(height_ + 2 * kBorder, 16, [&](int row) {
      const int y = row - kBorder;
      const float* const pixels = image.pixel(0, std::clamp(y, 0, height_ - 1));
      for (int c = 0; c < image.channels; ++c)
        for (int r = 0; r < kStep; ++r) {
          float* const to = planes_.row(kStep * (first + c) + r, y);
          for (int i = -kBorder; i < columns_ + kBorder; ++i) {
            const float value = pixels[image.channels * std::clamp(kStep * i + r, 0, width_ - 1) + c];
            to[i] = is_error ? std::min(value * value, kLargestVariance) + kSmallestVariance / 2 : value;
          }
        }
    });
  }

  vfloat value(int c, const Place& place, int x, int y) const {
    return load(planes_.row(kStep * c + place.residue, y) + x + place.column);
  }

  /// `row`: row of windows; `from`: the row of the sums that holds their centres.
  void add_windows(int x, int row, int from, Planes& sums) const {
    Windows w;
    const int y = kStep * row + 1;
    vfloat column;
    for (int l = 0; l < kLanes; ++l) column[l] = static_cast<float>(x + l);
    vfloat total = {};
    for (int dy = -kRadius; dy <= kRadius; ++dy) {
      if (y + dy < 0 || y + dy >= height_) continue;
      for (int dx = -kRadius; dx <= kRadius; ++dx) {
        const Place there(dx);
        const vfloat mask = load(mask_.row(there.residue, y + dy) + x + there.column);
        vfloat& root = w.roots[(dy + kRadius) * kSide + dx + kRadius];
        root = column < static_cast<float>(columns_) ? root_of_weight(x, y, dx, dy) * mask : vfloat{};
        total = fma(root, root, total);
      }
    }
    std::vector<Terms> planes(static_cast<size_t>(3 * n_sources_));
    fit(x, y, total, w, planes);
    for (int dy = -kRadius; dy <= kRadius; ++dy)
      if (y + dy >= 0 && y + dy < height_) predict(x, y, dy, from + dy, planes, w, sums);
  }

  vfloat root_of_weight(int x, int y, int dx, int dy) const {
    vfloat sum = {};
    for (int px = -kPatch; px <= kPatch; ++px) {
      const Place own(px), other(px + dx);
      for (int py = -kPatch; py <= kPatch; ++py)
        for (int c = 0; c < 3; ++c) {
          const vfloat difference = value(c, own, x, y + py) - value(c, other, x, y + dy + py);
          const vfloat v = value(3 + c, own, x, y + py), u = value(3 + c, other, x, y + dy + py);
          sum = fma(fma(difference, difference, -v) - min(v, u), reciprocal(v + u), sum);
        }
    }
    return exp2_of_nonpositive(min(sum * (-0.5f * kLog2E / (kOfPatch * kBandwidth * kBandwidth)), vfloat{}));
  }

  /// The terms of the pixels of row y + dy, relative to the centres, times the roots of their weights.
  void find_terms(int x, int y, int dy, const vfloat* roots, RowTerms& terms) const {
    for (int k = 0; k < kSide; ++k) {
      terms[0][k] = roots[k];
      terms[1][k] = roots[k] * (static_cast<float>(k - kRadius) / kPlaceUnit);
      terms[2][k] = roots[k] * (static_cast<float>(dy) / kPlaceUnit);
    }
    for (int a = 3; a < n_terms_; ++a) {
      const vfloat own = value(3 + a, Place(0), x, y);
      for (int k = 0; k < kSide; ++k) terms[a][k] = roots[k] * (value(3 + a, Place(k - kRadius), x, y + dy) - own);
    }
  }

  /// Fits the models of all channels, given the weights, whose sum is `total`.
  void fit(int x, int y, vfloat total, Windows& w, std::vector<Terms>& planes) const {
    const int n = n_terms_, n_channels = 3 * n_sources_;
    Terms products, inverse, shift;
    std::vector<vfloat> sums(batch::packed_size(n + n_channels)), of_row(sums.size());
    for (int dy = -kRadius; dy <= kRadius; ++dy) {
      if (y + dy < 0 || y + dy >= height_) continue;
      const vfloat* const roots = &w.roots[(dy + kRadius) * kSide];
      find_terms(x, y, dy, roots, w.terms);
      std::array<vfloat, kSide> colours;
      batch::gram(w.terms[0].data(), kSide, 1, n, kSide, of_row.data());
      for (size_t i = 0; i < batch::packed_size(n); ++i) sums[i] += of_row[i];
      for (int c = 0; c < n_channels; ++c) {
        for (int k = 0; k < kSide; ++k) colours[k] = roots[k] * value(first_source_ + c, Place(k - kRadius), x, y + dy);
        batch::multiply(w.terms[0].data(), kSide, 1, colours.data(), n, kSide, products.data());
        vfloat* const row = &sums[batch::packed(n + c, 0)];
        for (int a = 0; a < n; ++a) row[a] += products[a];
      }
    }
    shift.fill(max(total * kRidge, splat(1e-30f)));
    shift[0] = max(total * 1e-6f, splat(1e-30f));
    for (int a = first_of_position_; a < n; ++a)
      shift[a] = max(sums[batch::packed(a, a)] * kRidgeOfPosition, total * 1e-12f + splat(1e-30f));
    std::copy_n(&sums[batch::packed(n, 0)], n, planes[0].begin());
    batch::solve_shifted(sums.data(), shift.data(), n, planes[0].data(), inverse.data(), n_channels - 1);
    for (int c = 1; c < n_channels; ++c) {
      std::copy_n(&sums[batch::packed(n + c, 0)], n, planes[c].begin());
      batch::substitute_back(sums.data(), inverse.data(), n, planes[c].data());
    }
    // From differences to the centres to values.
    for (Terms& plane : planes)
      for (int a = 3; a < n; ++a) plane[0] = fnma(plane[a], value(3 + a, Place(0), x, y), plane[0]);
  }

  /// Adds the models' predictions for the pixels of row y + dy to `row` of the sums.
  void predict(int x, int y, int dy, int row, const std::vector<Terms>& planes, const Windows& w, Planes& sums) const {
    const auto add = [&](int c, const Place& place, vfloat term) {
      float* const sum = sums.row(kStep * c + place.residue, row) + x + place.column;
      store(sum, load(sum) + term);
    };
    for (int k = 0; k < kSide; ++k) {
      const Place place(k - kRadius);
      const vfloat root = w.roots[(dy + kRadius) * kSide + k], weight = root * root;
      for (int c = 0; c < 3 * n_sources_; ++c) {
        const Terms& plane = planes[c];
        vfloat prediction = fma(plane[1], splat(static_cast<float>(k - kRadius) / kPlaceUnit), plane[0]);
        prediction = fma(plane[2], splat(static_cast<float>(dy) / kPlaceUnit), prediction);
        for (int a = 3; a < n_terms_; ++a) prediction = fma(plane[a], value(3 + a, place, x, y + dy), prediction);
        add(c, place, weight * prediction);
      }
      add(3 * n_sources_, place, weight);
    }
  }

  void finish(int y, const std::vector<Planes>& bands, std::vector<Image>& images) const {
    constexpr int kRows = kBandRows * kStep;
    const int place = y + first_window_ * kStep;  // counted from the first band
    const int last = std::min((place + kBorder) / kRows, static_cast<int>(bands.size()) - 1);
    for (int x = 0; x < width_; ++x)
      for (int s = 0; s < n_sources_; ++s) {
        const float* const other = in_.others[s]->pixel(x, y);
        float total = kOfOther, sum[3];
        for (int c = 0; c < 3; ++c) sum[c] = kOfOther * other[c];
        for (int band = std::max(0, (place - kBorder) / kRows - 1); band <= last; ++band) {
          const int row = place - band * kRows;
          if (row >= kRows + kBorder) continue;
          const auto at = [&](int c) { return bands[band].row(kStep * c + x % kStep, row)[x / kStep]; };
          for (int c = 0; c < 3; ++c) sum[c] += at(3 * s + c);
          total += at(3 * n_sources_);
        }
        const bool is_valid = valid_[static_cast<size_t>(y) * width_ + x];
        for (int c = 0; c < 3; ++c) images[s].pixel(x, y)[c] = is_valid ? sum[c] / total : other[c];
      }
  }

  const RegressionInput& in_;
  const std::vector<unsigned char>& valid_;
  const int width_, height_, columns_, first_window_;  // the last: of the first band, in the whole image
  int n_terms_, n_sources_, first_of_position_, first_source_;
  Planes planes_, mask_;
};

}  // namespace

std::vector<Image> regressed(const RegressionInput& input, std::span<const Image* const> features,
                             const std::vector<unsigned char>& valid) {
  return input.coarse ? Regression<4>(input, features, valid).run() : Regression<3>(input, features, valid).run();
}

}  // namespace covary
