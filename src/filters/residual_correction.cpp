// SPDX-License-Identifier: Apache-2.0
#include "filters/residual_correction.h"

#include <algorithm>
#include <array>

#include "core/error.h"
#include "filters/guided_cells.h"
#include "filters/window_sums.h"

namespace covary {

using namespace lanes;

namespace {

constexpr int kGuide = 0, kResidual = 3, kWeight = 6, kVariance = 7, kPlanes = 8;
/// Side of the cells of the wide mean.
constexpr int kCell = 2;
/// Bandwidths of the wide mean and of the second correction, relative to the narrow mean's.
constexpr float kWidening = 4, kSecondWidening = 12;
/// Variance of the narrow mean, relative to that of the estimate, at which both means count equally. Values from 0.1 to
/// 3 trade bias for error, slowly (docs/notes/iicv.md).
constexpr float kNoise = 0.2f;
/// Variance of a wide mean, relative to that of the estimate, at which half of it is restored.
constexpr float kWideNoise = 1;
constexpr float kMinSquare = 1e-4f;  // minimum squared bandwidth of the residual

/// Cells of side x side pixels with the guide F^: sums over the valid pixels of n (h - F^), n and n^2 var h (over RGB),
/// where n is the pixel's count relative to the image's mean.
Planes make_cells(int side, const Moments& h, const std::vector<unsigned char>& valid, const Image& f, int border) {
  const auto add = [&](int x, int y, float* sums) {
    const float n = h.relative_count ? h.relative_count->row(0, y)[x] : 1.0f;
    for (int c = 0; c < 3; ++c) {
      sums[kResidual - 3 + c] += n * (h.mean.row(c, y)[x] - f.pixel(x, y)[c]);
      sums[kVariance - 3] += n * n * h.variance_of_mean.row(c, y)[x];
    }
    sums[kWeight - 3] += n;
  };
  return sums_by_cell(side, border, f, valid, kPlanes - 3, add);
}

/// Weighted mean of residuals around kLanes pixels.
struct GuidedMean {
  vfloat weights = {}, residuals[3] = {}, squares = {};  ///< squares: sum of w^2 var h
  /// Zero if nothing is similar.
  vfloat value(int c) const { return residuals[c] / max(weights, splat(1e-20f)); }
  /// The pixel's own part of it: in cells, which hold it with its weight at the centre, about the same.
  vfloat own() const { return weights > 1e-3f ? 1 / weights : vfloat{}; }
  /// t / (t + v), where v is the mean's variance summed over RGB and t = `tolerated`. 0 without weights, or beyond the
  /// range of floats.
  vfloat share(vfloat tolerated) const {
    const vfloat excess = (squares + splat(1e-30f)) / max(tolerated * weights * weights, splat(1e-37f));
    return excess >= 0.0f ? 1 / (1 + excess) : vfloat{};
  }
};

/// r of residual_correction.h at the pixels (x + lane, y) with values f, over (2 radius + 1)^2 cells.
template <int side>
GuidedMean guided_mean(const Planes& cells, int radius, int x, int y, const vfloat* f, vfloat squared_bandwidth) {
  vfloat weights = {}, squares = {}, r0 = {}, r1 = {}, r2 = {};
  add_alike<3>({cells, kGuide, radius, side}, x, y / side, f, squared_bandwidth, [&](vfloat w, int column, int row) {
    const auto at = [&](int plane) { return load(cells.row(plane, row) + column); };
    weights = fma(w, at(kWeight), weights);
    squares = fma(w * w, at(kVariance), squares);
    r0 = fma(w, at(kResidual), r0);
    r1 = fma(w, at(kResidual + 1), r1);
    r2 = fma(w, at(kResidual + 2), r2);
  });
  return {weights, {r0, r1, r2}, squares};
}

/// Adds correction(x, y, f, variance) to each valid pixel: three vfloats for the pixels (x + lane, y) with values f and
/// squared standard errors `variance`, summed over RGB.
template <typename Correction>
void add_everywhere(const std::vector<unsigned char>& valid, const Image& std_error, const Correction& correction,
                    Image& estimate) {
  const int width = estimate.width;
  for_each_batch(width, estimate.height, [&](int x, int y, int n) {
    vfloat f[3], variance = {};
    for (int c = 0; c < 3; ++c) {
      vfloat error;
      for (int l = 0; l < kLanes; ++l) {
        f[c][l] = estimate.pixel(std::min(x + l, width - 1), y)[c];
        error[l] = std_error.pixel(std::min(x + l, width - 1), y)[c];
      }
      variance += error * error;
    }
    const std::array<vfloat, 3> added = correction(x, y, f, variance);
    for (int l = 0; l < n; ++l)
      if (valid[static_cast<size_t>(y) * width + x + l])
        for (int c = 0; c < 3; ++c) estimate.pixel(x + l, y)[c] += added[c][l];
  });
}

}  // namespace

void add_residual_correction(const Moments& h, const ResidualCorrectionOptions& options,
                             const std::vector<unsigned char>& valid, const Image& std_error, Image& estimate,
                             Image* own_weight) {
  const auto add_own_weight = [&](int x, int y, vfloat weight) {
    if (!own_weight) return;
    for (int l = 0; l < std::min(kLanes, estimate.width - x); ++l) *own_weight->pixel(x + l, y) += weight[l];
  };
  const float bandwidth = options.bandwidth * options.bandwidth;
  {
    const int wide_radius = options.window / 2 / kCell, narrow_radius = options.window / 4;
    const Planes cells = make_cells(kCell, h, valid, estimate, wide_radius * kCell);
    const Planes pixels = make_cells(1, h, valid, estimate, narrow_radius);
    const auto mixed = [&](int x, int y, const vfloat* f, vfloat variance) {
      const GuidedMean narrow = guided_mean<1>(pixels, narrow_radius, x, y, f, variance * bandwidth);
      const GuidedMean wide =
          guided_mean<kCell>(cells, wide_radius, x, y, f, variance * (bandwidth * kWidening * kWidening));
      const vfloat a = narrow.share(kNoise * variance), b = (1 - a) * wide.share(kWideNoise * variance);
      add_own_weight(x, y, a * narrow.own() + b * wide.own());
      std::array<vfloat, 3> result;
      for (int c = 0; c < 3; ++c) result[c] = a * narrow.value(c) + b * wide.value(c);
      return result;
    };
    add_everywhere(valid, std_error, mixed, estimate);
  }
  const int radius = options.window / 2 / kResidualCell;
  const Planes cells = make_cells(kResidualCell, h, valid, estimate, radius * kResidualCell);
  const auto second = [&](int x, int y, const vfloat* f, vfloat variance) {
    const GuidedMean mean =
        guided_mean<kResidualCell>(cells, radius, x, y, f, variance * (bandwidth * kSecondWidening * kSecondWidening));
    const vfloat b = mean.share(kWideNoise * variance);
    add_own_weight(x, y, b * mean.own());
    return std::array<vfloat, 3>{b * mean.value(0), b * mean.value(1), b * mean.value(2)};
  };
  add_everywhere(valid, std_error, second, estimate);
}

void add_residual(const Moments& h, const ResidualOptions& options, const std::vector<unsigned char>& valid,
                  Image& estimate) {
  COVARY_CHECK(options.cell == 2 || options.cell == 4, "cells of the residual have sides of 2 or 4 pixels");
  const auto mean_around = options.cell == 2 ? guided_mean<2> : guided_mean<4>;
  const int radius = options.window / 2 / options.cell;
  const Planes cells = make_cells(options.cell, h, valid, estimate, radius * options.cell);
  for_each_batch(estimate.width, estimate.height, [&](int x, int y, int n) {
    vfloat f[3], brightness = {};
    for (int c = 0; c < 3; ++c) {
      for (int l = 0; l < kLanes; ++l) f[c][l] = estimate.pixel(std::min(x + l, estimate.width - 1), y)[c];
      brightness += f[c] * (options.bandwidth / 3);
    }
    const GuidedMean mean = mean_around(cells, radius, x, y, f, brightness * brightness + kMinSquare);
    for (int l = 0; l < n; ++l)
      if (valid[static_cast<size_t>(y) * estimate.width + x + l])
        for (int c = 0; c < 3; ++c) estimate.pixel(x + l, y)[c] += mean.value(c)[l];
  });
}

}  // namespace covary
