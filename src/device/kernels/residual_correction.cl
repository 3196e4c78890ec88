// SPDX-License-Identifier: Apache-2.0
// The residual correction of filters/residual_correction.h: cells of pixels, and guided means of the residuals in them.
//
// Definitions: SIDE of the cells, 1, 2 or 4.
// Compiled: SIDE=1
// Compiled: SIDE=2
// Compiled: SIDE=4
#include "portable.h"

#define FAR 1e18f
#define LOG2_E 1.44269504f
// Of residual_correction.cpp: bandwidths relative to the narrow mean's, and tolerated variances.
#define WIDENING 4.0f
#define SECOND_WIDENING 12.0f
#define NOISE 0.2f
#define WIDE_NOISE 1.0f
#define LEAST_SQUARE 1e-4f

FUNCTION int cells_of(int pixels) { return (pixels + SIDE - 1) / SIDE; }

// For each cell, one item: in `guides`, the mean of F^ over its valid pixels (FAR without any) and the sum of n; in
// `residuals`, the sums of n (h - F^) and of n^2 var h over RGB; n: the pixel's relative count. `guide`, `other`: of
// pair_moments.cl; var h from h's sum over RGB.
KERNEL residual_cells(GLOBAL const float* RESTRICT estimate, GLOBAL const uchar* RESTRICT valid,
                      GLOBAL const float* RESTRICT guide, GLOBAL const float* RESTRICT other, int width, int height,
                      GLOBAL float* RESTRICT guides, GLOBAL float* RESTRICT residuals) {
  const int column = get_global_id(0), row = get_global_id(1);
  if (column >= cells_of(width) || row >= cells_of(height)) return;
  float number = 0.0f, weight = 0.0f, variance = 0.0f, mean[3] = {0.0f, 0.0f, 0.0f}, sum[3] = {0.0f, 0.0f, 0.0f};
  for (int y = SIDE * row; y < min(height, SIDE * (row + 1)); ++y)
    for (int x = SIDE * column; x < min(width, SIDE * (column + 1)); ++x) {
      const int p = y * width + x;
      if (!valid[p]) continue;
      const float n = guide[4 * (size_t)p + 3];
      for (int c = 0; c < 3; ++c) {
        const float f = estimate[3 * (size_t)p + c];
        mean[c] += f;
        sum[c] += n * (other[4 * (size_t)p + c] - f);
      }
      variance += n * n * other[4 * (size_t)p + 3];
      weight += n;
      number += 1.0f;
    }
  for (int c = 0; c < 3; ++c) mean[c] = number > 0.0f ? mean[c] / number : FAR;
  const int cell = row * cells_of(width) + column;
  vstore4(FLOAT4(mean[0], mean[1], mean[2], weight), cell, guides);
  vstore4(FLOAT4(sum[0], sum[1], sum[2], variance), cell, residuals);
}

// Weighted mean of residuals around a pixel: sums of w n, w n (h - F^), and w^2 n^2 var h.
typedef struct {
  float weights, squares, residuals[3];
} GuidedMean;

// r of residual_correction.h at pixel (x, y) with value f, over (2 radius + 1)^2 cells.
FUNCTION GuidedMean guided_mean(GLOBAL const float* guides, GLOBAL const float* residuals, int side, int radius,
                                int width, int height, int x, int y, const float* f, float squared_bandwidth) {
  const int columns = (width + side - 1) / side, rows = (height + side - 1) / side;
  const float factor = -LOG2_E / fmax(squared_bandwidth, 1e-30f);
  float weights = 0.0f, squares = 0.0f, r0 = 0.0f, r1 = 0.0f, r2 = 0.0f;
  for (int row = max(y / side - radius, 0); row <= min(y / side + radius, rows - 1); ++row)
    for (int column = max(x / side - radius, 0); column <= min(x / side + radius, columns - 1); ++column) {
      const float4 g = vload4(row * columns + column, guides), r = vload4(row * columns + column, residuals);
      const float w = exp2_of_nonpositive(squared_length(g.x - f[0], g.y - f[1], g.z - f[2]) * factor);
      weights = fma(w, g.w, weights);
      squares = fma(w * w, r.w, squares);
      r0 = fma(w, r.x, r0), r1 = fma(w, r.y, r1), r2 = fma(w, r.z, r2);
    }
  GuidedMean mean;
  mean.weights = weights, mean.squares = squares;
  mean.residuals[0] = r0, mean.residuals[1] = r1, mean.residuals[2] = r2;
  return mean;
}

// Zero if nothing is similar.
FUNCTION float value_of(const GuidedMean* mean, int c) { return mean->residuals[c] / fmax(mean->weights, 1e-20f); }

// t / (t + v), where v is the mean's variance summed over RGB and t = `tolerated`. 0 without weights.
FUNCTION float share_of(const GuidedMean* mean, float tolerated) {
  const float excess = (mean->squares + 1e-30f) / fmax(tolerated * mean->weights * mean->weights, 1e-37f);
  return excess >= 0.0f ? 1.0f / (1.0f + excess) : 0.0f;
}

FUNCTION float squared_error_of(GLOBAL const float* std_error, int p) {
  float sum = 0.0f;
  for (int c = 0; c < 3; ++c) sum += std_error[3 * (size_t)p + c] * std_error[3 * (size_t)p + c];
  return sum;
}

// Adds F^' - F^, one item a pixel: the narrow mean over pixels and the wide one over cells of 2 x 2. `bandwidth`:
// kappa^2. `guides_1`, `guides_2`: of residual_cells with that SIDE; used with SIDE=1.
KERNEL correct_mixed(GLOBAL const float* RESTRICT guides_1, GLOBAL const float* RESTRICT residuals_1,
                     GLOBAL const float* RESTRICT guides_2, GLOBAL const float* RESTRICT residuals_2,
                     GLOBAL const uchar* RESTRICT valid, GLOBAL const float* RESTRICT std_error, int width, int height,
                     int narrow_radius, int wide_radius, float bandwidth, GLOBAL float* RESTRICT estimate) {
  const int x = get_global_id(0), y = get_global_id(1), p = y * width + x;
  if (x >= width || y >= height || !valid[p]) return;
  float f[3];
  for (int c = 0; c < 3; ++c) f[c] = estimate[3 * (size_t)p + c];
  const float variance = squared_error_of(std_error, p);
  const GuidedMean narrow =
      guided_mean(guides_1, residuals_1, 1, narrow_radius, width, height, x, y, f, variance * bandwidth);
  const GuidedMean wide = guided_mean(guides_2, residuals_2, 2, wide_radius, width, height, x, y, f,
                                      variance * (bandwidth * WIDENING * WIDENING));
  const float a = share_of(&narrow, NOISE * variance);
  const float b = (1.0f + PLANTED_BUG - a) * share_of(&wide, WIDE_NOISE * variance);
  for (int c = 0; c < 3; ++c) estimate[3 * (size_t)p + c] = f[c] + (a * value_of(&narrow, c) + b * value_of(&wide, c));
}

// Adds F^'' - F^', one item a pixel: means over cells of SIDE x SIDE pixels.
KERNEL correct_again(GLOBAL const float* RESTRICT guides, GLOBAL const float* RESTRICT residuals,
                     GLOBAL const uchar* RESTRICT valid, GLOBAL const float* RESTRICT std_error, int width, int height,
                     int radius, float bandwidth, GLOBAL float* RESTRICT estimate) {
  const int x = get_global_id(0), y = get_global_id(1), p = y * width + x;
  if (x >= width || y >= height || !valid[p]) return;
  float f[3];
  for (int c = 0; c < 3; ++c) f[c] = estimate[3 * (size_t)p + c];
  const float variance = squared_error_of(std_error, p);
  const GuidedMean mean = guided_mean(guides, residuals, SIDE, radius, width, height, x, y, f,
                                      variance * (bandwidth * SECOND_WIDENING * SECOND_WIDENING));
  const float b = share_of(&mean, (WIDE_NOISE + PLANTED_BUG) * variance);
  for (int c = 0; c < 3; ++c) estimate[3 * (size_t)p + c] = f[c] + b * value_of(&mean, c);
}

// What residual_cells reads, from the mean h of an image with its variance, and the numbers of samples of its pixels
// relative to their mean, 1 without them.
KERNEL residual_input(GLOBAL const float* RESTRICT h, GLOBAL const float* RESTRICT variance,
                      GLOBAL const float* RESTRICT relative_counts, int has_counts, int n_pixels, GLOBAL float* RESTRICT guide, GLOBAL float* RESTRICT other) {
  const int p = get_global_id(0);
  if (p >= n_pixels) return;
  vstore4(FLOAT4(0.0f, 0.0f, 0.0f, has_counts ? relative_counts[p] : 1.0f), p, guide);
  GLOBAL const float *mean = h + 3 * (size_t)p, *v = variance + 3 * (size_t)p;
  vstore4(FLOAT4(mean[0], mean[1], mean[2], v[0] + v[1] + v[2]), p, other);
}

// The estimate with its residual (ResidualOptions), from element `first` of `result` on, one item a pixel: means over
// cells of SIDE x SIDE pixels with the squared bandwidth (k f')^2 + 1e-4; `bandwidth`: k.
KERNEL add_residual(GLOBAL const float* RESTRICT guides, GLOBAL const float* RESTRICT residuals,
                    GLOBAL const uchar* RESTRICT valid, GLOBAL const float* RESTRICT estimate, int width, int height,
                    int radius, float bandwidth, int first, GLOBAL float* RESTRICT result) {
  const int x = get_global_id(0), y = get_global_id(1), p = y * width + x;
  if (x >= width || y >= height) return;
  float f[3], brightness = 0.0f;
  for (int c = 0; c < 3; ++c) {
    f[c] = estimate[3 * (size_t)p + c];
    brightness += f[c] * (bandwidth / 3);
  }
  const GuidedMean mean = guided_mean(guides, residuals, SIDE, radius, width, height, x, y, f,
                                      brightness * brightness + LEAST_SQUARE);
  for (int c = 0; c < 3; ++c)
    result[first + 3 * (size_t)p + c] = f[c] + (valid[p] ? (1.0f - PLANTED_BUG) * value_of(&mean, c) : 0.0f);
}
