// SPDX-License-Identifier: Apache-2.0
#include "risk/held_out_bias.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "filters/window_sums.h"
#include "risk/relative_weight.h"

namespace covary {
namespace {

using namespace lanes;

constexpr int kRadii[] = {3, 7};     // radii in cells, the narrow window first
constexpr int kBorder = 7;           // largest radius
constexpr float kBandwidth = 0.5f;   // relative to the target's brightness
constexpr float kMinSquare = 1e-4f;  // minimum squared bandwidth
constexpr float kSignificant = 3;    // standard errors
constexpr float kMinCells = 20;      // similar cells: fewer determine their noise too poorly
constexpr float kPixels = kBiasCell * kBiasCell;
constexpr float kMinRelative = 1e-4f;  // relative to the brightness: smaller values are rounding errors
static_assert(kBiasHalo >= (kBorder + 1) * kBiasCell);

/// Planes of cells: guides of both halves (kFar where no pixel is valid), sums of M - h for both, half the square of
/// their difference, the same with the weight of relMSE, number of valid pixels.
constexpr int kGuide = 0, kResidual = 6, kSquare = 12, kRelative = 15, kCount = 18, kPlanes = 19;

/// Sums over the pixels of one cell.
struct Cell {
  float guide[2][3] = {}, residual[2][3] = {}, count = 0;
};

Cell cell_of(const HeldOutBiasInput& in, int x0, int y0) {
  const int width = in.halves[0]->width, height = in.halves[0]->height;
  Cell cell;
  for (int y = y0; y < std::min(height, y0 + kBiasCell); ++y)
    for (int x = x0; x < std::min(width, x0 + kBiasCell); ++x) {
      if (!(*in.valid)[static_cast<size_t>(y) * width + x]) continue;
      cell.count += 1;
      for (int half : {0, 1})
        for (int c = 0; c < 3; ++c) {
          cell.guide[half][c] += in.guides[half]->pixel(x, y)[c];
          cell.residual[half][c] += in.halves[half]->pixel(x, y)[c] - in.independent[half]->mean.row(c, y)[x];
        }
    }
  return cell;
}

float weight_of(const Cell& cell) {
  float guide[3];
  for (int c = 0; c < 3; ++c) guide[c] = 0.5f * (cell.guide[0][c] + cell.guide[1][c]) / cell.count;
  return relative_weight(guide);
}

Planes cells_of(const HeldOutBiasInput& in) {
  const int width = (in.halves[0]->width + kBiasCell - 1) / kBiasCell;
  const int height = (in.halves[0]->height + kBiasCell - 1) / kBiasCell;
  Planes cells(width, height, kPlanes, kBorder, 0.0f);
  for (int plane = kGuide; plane < kResidual; ++plane)
    for (int y = -kBorder; y < height + kBorder; ++y) std::fill_n(cells.row(plane, y) - kBorder, cells.stride(), kFar);
  parallel_for(height, 4, [&](int y) {
    for (int x = 0; x < width; ++x) {
      const Cell cell = cell_of(in, x * kBiasCell, y * kBiasCell);
      if (cell.count == 0) continue;
      cells.row(kCount, y)[x] = cell.count;
      const float weight = weight_of(cell);
      for (int c = 0; c < 3; ++c) {
        for (int half : {0, 1}) {
          cells.row(kGuide + 3 * half + c, y)[x] = cell.guide[half][c] / cell.count;
          cells.row(kResidual + 3 * half + c, y)[x] = cell.residual[half][c];
        }
        const float difference = cell.residual[0][c] - cell.residual[1][c];
        cells.row(kSquare + c, y)[x] = 0.5f * difference * difference;
        cells.row(kRelative + c, y)[x] = 0.5f * difference * difference * weight;
      }
    }
  });
  return cells;
}

/// d and v of one half at the cells (x + lane, y).
struct GuidedMean {
  vfloat mean[3] = {}, variance[3] = {};
  vfloat cells = {};  ///< effective number of cells
};

GuidedMean guided_mean(const Planes& cells, int half, int radius, int x, int y) {
  const int guide = kGuide + 3 * (1 - half), residual = kResidual + 3 * half;
  vfloat g[3];
  for (int c = 0; c < 3; ++c) g[c] = load(cells.row(guide + c, y) + x);
  const vfloat grey = (g[0] + g[1] + g[2]) * (1.0f / 3);
  GuidedMean sums;
  vfloat weights = {}, squares = {}, counts = {}, relative[3] = {};
  const vfloat squared_bandwidth = kBandwidth * kBandwidth * grey * grey + kMinSquare;
  add_alike({cells, guide, radius}, x, y, g, squared_bandwidth, [&](vfloat weight, int column, int row) {
    const auto at = [&](int plane) { return load(cells.row(plane, row) + column); };
    const vfloat count = at(kCount);
    weights += weight * count;
    squares += weight * weight * count * count;
    counts += count;
    for (int c = 0; c < 3; ++c) {
      sums.mean[c] += weight * at(residual + c);
      sums.variance[c] += weight * weight * at(kSquare + c);
      relative[c] += at(kRelative + c);
    }
  });
  const vfloat inverse = 1.0f / max(weights, splat(1e-20f));
  const vfloat per_cell = squares * (grey * grey + 0.01f) / max(counts * kPixels, splat(1e-20f));
  sums.cells = weights * weights / max(squares, splat(1e-20f));
  for (int c = 0; c < 3; ++c) {
    sums.mean[c] *= inverse;
    sums.variance[c] = max(sums.variance[c], relative[c] * per_cell) * inverse * inverse;
  }
  return sums;
}

/// The bias from both halves' means, zero if not significant.
vfloat significant(const GuidedMean& of_a, const GuidedMean& of_b, int c, vfloat brightness) {
  const vfloat a = of_a.mean[c], b = of_b.mean[c], variance = 0.25f * (of_a.variance[c] + of_b.variance[c]);
  const vfloat bias = 0.5f * (a + b), square = bias * bias, difference = a - b, least = kMinRelative * brightness;
  const auto is_bias = (square > kSignificant * kSignificant * variance) & (difference * difference < square) &
                       (square > least * least) & (min(of_a.cells, of_b.cells) > kMinCells);
  return is_bias ? bias - variance / bias : vfloat{};
}

}  // namespace

Image held_out_bias(const HeldOutBiasInput& input) {
  const int width = input.halves[0]->width, height = input.halves[0]->height;
  const Planes cells = cells_of(input);
  Image result(width, height, 3);
  for_each_batch(cells.width(), cells.height(), [&](int x, int y, int n) {
    vfloat bias[3] = {}, brightness = {};
    for (int plane = kGuide; plane < kResidual; ++plane) brightness += load(cells.row(plane, y) + x) * (1.0f / 6);
    for (const int radius : kRadii) {
      const GuidedMean a = guided_mean(cells, 0, radius, x, y), b = guided_mean(cells, 1, radius, x, y);
      for (int c = 0; c < 3; ++c) bias[c] = bias[c] != 0.0f ? bias[c] : significant(a, b, c, brightness);
    }
    const int first = x * kBiasCell, last = std::min(width, (x + n) * kBiasCell);
    for (int py = y * kBiasCell; py < std::min(height, (y + 1) * kBiasCell); ++py)
      for (int px = first; px < last; ++px)
        if ((*input.valid)[static_cast<size_t>(py) * width + px])
          for (int c = 0; c < 3; ++c) result.pixel(px, py)[c] = bias[c][(px - first) / kBiasCell];
  });
  return result;
}

}  // namespace covary
