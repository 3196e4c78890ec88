// SPDX-License-Identifier: Apache-2.0
#include "dependent_tests/bound_filter.h"

#include <algorithm>
#include <limits>

namespace covary {
namespace {

using namespace lanes;

constexpr int kNewtonSteps = 24;
constexpr float kTolerance = 1e-5f;  // relative residual of the equation
/// Minimum variance, relative to the squared brightness, where there is no noise.
constexpr float kMinVariance = 1e-12f;

/// 1 / v_q and 3 sqrt(v_q) of every pixel for sigma = 1; pixels without samples have weight 0 and give no initial
/// bound.
struct Precision {
  Planes weight, radius;

  explicit Precision(const FilterInput& input)
      : weight(input.width(), input.height(), 1, input.count.border(), 0),
        radius(input.width(), input.height(), 1, input.count.border(), kFar) {
    parallel_for(input.height(), 8, [&](int y) {
      for (int x = 0; x < input.width(); ++x) {
        const float count = input.count.row(0, y)[x];
        if (count <= 0) continue;
        const float v = 1 / count;
        weight.row(0, y)[x] = 1 / v;
        radius.row(0, y)[x] = 3 * std::sqrt(v);
      }
    });
  }

  /// sigma^2 of a pixel, at least a tiny positive value.
  static float positive_variance(const FilterInput& input, int x, int y) {
    const Spectrum colour(input.dependent.row(0, y)[x], input.dependent.row(1, y)[x], input.dependent.row(2, y)[x]);
    const float brightness = std::min(colour_length(colour), 1e6f);
    return std::max(input.variance.row(0, y)[x], kMinVariance * (brightness * brightness + kMinVariance));
  }
};

/// The window of one batch of pixels: differences, then weights.
class Window {
 public:
  Window(const FilterInput& input, const Precision& precision, int window)
      : input_(input),
        precision_(precision),
        radius_(window / 2),
        differences_((2 * radius_ + 1) * (2 * radius_ + 1)) {}

  /// Writes the first n pixels of the batch at (x, y).
  void apply(int x, int y, int n, const Planes* scale, FilteredImage& result) {
    x_ = x, y_ = y;
    for (int l = 0; l < n; ++l) variance_[l] = Precision::positive_variance(input_, x + l, y);
    const vfloat right_side = 9.0f * variance_;
    vfloat lambda = read_differences(scale ? load(scale->row(0, y) + x) : splat(1));
    // Newton from above: the left side is convex, so every step stays above the solution. A pixel's steps do not depend
    // on the others in its batch.
    for (int step = 0; step < kNewtonSteps; ++step) {
      const auto [sum, slope] = left_side(lambda);
      const vfloat excess = max(sum - right_side, splat(0));
      const vfloat change = excess > kTolerance * right_side ? excess / (2.0f * max(slope, splat(1e-30f))) : vfloat{};
      lambda -= change;
      if (is_zero(change)) break;
    }
    write(lambda, n, result);
  }

 private:
  /// Calls f(i, row, column) for every place in the window.
  template <typename F>
  void for_each(const F& f) const {
    size_t i = 0;
    for (int dy = -radius_; dy <= radius_; ++dy)
      for (int dx = -radius_; dx <= radius_; ++dx) f(i++, y_ + dy, x_ + dx);
  }

  static bool is_zero(vfloat v) {
    bool zero = true;
    for (int l = 0; l < kLanes; ++l) zero &= v[l] == 0;
    return zero;
  }

  /// Returns an upper bound on lambda: each pixel's term alone must not exceed the right side.
  vfloat read_differences(vfloat scale) {
    const Planes& d = input_.dependent;
    const vfloat r = load(d.row(0, y_) + x_), g = load(d.row(1, y_) + x_), b = load(d.row(2, y_) + x_);
    vfloat bound = splat(kFar);
    const vfloat deviation = sqrt(variance_);
    for_each([&](size_t i, int qy, int qx) {
      const vfloat dr = load(d.row(0, qy) + qx) - r, dg = load(d.row(1, qy) + qx) - g, db = load(d.row(2, qy) + qx) - b;
      const vfloat difference = max(dr, -dr) + max(dg, -dg) + max(db, -db);
      differences_[i] = min(difference * scale, splat(kFar));
      bound = min(bound, differences_[i] + deviation * load(precision_.radius.row(0, qy) + qx));
    });
    return bound;
  }

  struct LeftSide {
    vfloat sum, slope;  // sum ((lambda - Delta)^+)^2 / v and sum (lambda - Delta)^+ / v
  };
  LeftSide left_side(vfloat lambda) const {
    LeftSide side{};
    for_each([&](size_t i, int qy, int qx) {
      const vfloat excess = max(lambda - differences_[i], splat(0));
      const vfloat weighted = excess * load(precision_.weight.row(0, qy) + qx);
      side.slope += weighted;
      side.sum = fma(weighted, excess, side.sum);
    });
    return side;
  }

  void write(vfloat lambda, int n, FilteredImage& result) const {
    vfloat colour[3] = {}, partners = {}, slope = {}, sum = {};
    for_each([&](size_t i, int qy, int qx) {
      const vfloat excess = max(lambda - differences_[i], splat(0));
      const vfloat weighted = excess * load(precision_.weight.row(0, qy) + qx);
      for (int c = 0; c < 3; ++c) colour[c] = fma(weighted, load(input_.independent.row(c, qy) + qx), colour[c]);
      partners += weighted > splat(0) ? splat(1) : vfloat{};
      slope += weighted;
      sum = fma(weighted, excess, sum);
    });
    const vfloat own = max(lambda, splat(0)) * load(precision_.weight.row(0, y_) + x_);
    for (int l = 0; l < n; ++l) {
      const int x = x_ + l;
      const bool alone = slope[l] <= 0;  // no pixel of the window has samples
      for (int c = 0; c < 3; ++c) result.colour.pixel(x, y_)[c] = alone ? 0 : colour[c][l] / slope[l];
      result.region.pixel(x, y_)[0] = partners[l];
      result.centre_weight.pixel(x, y_)[0] = alone ? 0 : own[l] / slope[l];
      result.bound.pixel(x, y_)[0] = alone ? std::numeric_limits<float>::infinity() : lambda[l];
      // sum f^2 v = sum weighted excess / slope^2, in units of sigma^2.
      result.effective_samples.pixel(x, y_)[0] =
          alone ? 0 : std::max(input_.count.row(0, y_)[x], slope[l] * slope[l] / std::max(sum[l], 1e-30f));
    }
  }

  const FilterInput& input_;
  const Precision& precision_;
  int radius_, x_ = 0, y_ = 0;
  vfloat variance_ = splat(1);  ///< sigma^2 of the centres
  std::vector<vfloat> differences_;
};

}  // namespace

FilteredImage bound_filter(const FilterInput& input, int window, const Planes* difference_scale) {
  const Precision precision(input);
  FilteredImage result(input.width(), input.height());
  parallel_for(input.height(), 4, [&](int y) {
    Window batch(input, precision, window);
    for (int x = 0; x < input.width(); x += kLanes)
      batch.apply(x, y, std::min(kLanes, input.width() - x), difference_scale, result);
  });
  return result;
}

}  // namespace covary
