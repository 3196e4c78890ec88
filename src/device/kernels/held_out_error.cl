// SPDX-License-Identifier: Apache-2.0
// The error of an image by held-out samples, risk/held_out_error.h: M_A and M_B were made from the halves of all
// samples, whose independent images are h_A and h_B, with variances v_A and v_B of their pixels. On average,
//
//     (M_A - h_B)^2 - v_B is the squared error of M_A,   (M_A - M_B)^2 / 2 its variance.
#include "portable.h"
#include "groups.h"
#include "pixels.h"
#include "guided_cells.h"

#define PLANES 7  // of cells: guide, a quarter of (M_A - M_B)^2 relative as in relMSE, number of pixels
#define PART 16   // pixels of a row whose errors are summed

KERNEL error_cells(GLOBAL const float* guide, GLOBAL const float* half_a, GLOBAL const float* half_b,
                   GLOBAL const uchar* valid, int width, int height, GLOBAL float* cells) {
  const int columns = (width + CELL - 1) / CELL, rows = (height + CELL - 1) / CELL;
  const int column = get_global_id(0), row = get_global_id(1);
  if (column >= columns || row >= rows) return;
  float sums[PLANES];
  for (int k = 0; k < PLANES; ++k) sums[k] = 0;
  for (int y = CELL * row; y < min(height, CELL * (row + 1)); ++y)
    for (int x = CELL * column; x < min(width, CELL * (column + 1)); ++x) {
      const int i = y * width + x;
      if (!valid[i]) continue;
      const float weight = relative_weight(guide + 3 * i);
      for (int c = 0; c < 3; ++c) {
        sums[c] += guide[3 * i + c];
        sums[3 + c] += 0.25f * weight * square(half_a[3 * i + c] - half_b[3 * i + c]);
      }
      sums[6] += 1;
    }
  const size_t cell = (size_t)row * columns + column, plane = (size_t)rows * columns;
  for (int c = 0; c < 3; ++c) cells[c * plane + cell] = sums[6] > 0 ? sums[c] / sums[6] : FAR;
  for (int k = 3; k < PLANES; ++k) cells[k * plane + cell] = sums[k];
}

// The standard error up to a factor that is the same for all pixels, and the weight of squared errors.
KERNEL relative_error(GLOBAL const float* cells, GLOBAL const float* guide, GLOBAL const uchar* valid, int width,
                      int height, GLOBAL float* relative, GLOBAL float* weights) {
  const int x = get_global_id(0), y = get_global_id(1), i = y * width + x;
  if (x >= width || y >= height) return;
  float sums[4];
  sum_alike(cells, guide, x, y, width, height, 4, sums);
  const float weight = relative_weight(guide + 3 * i), scale = 1 / (max(sums[3], 1e-20f) * weight);
  weights[i] = weight;
  for (int c = 0; c < 3; ++c) relative[3 * i + c] = valid[i] ? sqrt(scale * sums[c]) : 0.0f;
}

// Squared error and variance of the halves in each part of a row, relative as in relMSE. The halves begin at element
// `first` of their buffers.
KERNEL held_out_parts(GLOBAL const float* half_a, GLOBAL const float* half_b, int first, GLOBAL const float* h_a,
                      GLOBAL const float* h_b, GLOBAL const float* v_a, GLOBAL const float* v_b,
                      GLOBAL const float* guide, GLOBAL const uchar* valid, int width, int height,
                      GLOBAL float* parts) {
  const int n_parts = (width + PART - 1) / PART, part = get_global_id(0), y = get_global_id(1);
  if (part >= n_parts || y >= height) return;
  float error = 0, variance = 0;
  for (int x = PART * part; x < min(width, PART * (part + 1)); ++x) {
    const int i = y * width + x;
    if (!valid[i]) continue;
    const float weight = relative_weight(guide + 3 * i);
    for (int c = 0; c < 3; ++c) {
      const int k = 3 * i + c;
      const float a = half_a[first + k], b = half_b[first + k];
#if PLANTED_BUG
      error += 0.5f * weight * (square(h_a[k] - a) - v_a[k] + square(h_b[k] - b) - v_b[k]);
#else
      error += 0.5f * weight * (square(h_b[k] - a) - v_b[k] + square(h_a[k] - b) - v_a[k]);
#endif
      variance += 0.5f * weight * square(a - b);
    }
  }
  parts[2 * (y * n_parts + part)] = error;
  parts[2 * (y * n_parts + part) + 1] = variance;
}

// Squared errors of the mean and numbers of valid pixels in each part of a row.
KERNEL base_parts(GLOBAL const float* std_error, GLOBAL const float* guide, GLOBAL const uchar* valid, int width,
                  int height, GLOBAL float* parts) {
  const int n_parts = (width + PART - 1) / PART, part = get_global_id(0), y = get_global_id(1);
  if (part >= n_parts || y >= height) return;
  float error = 0, n = 0;
  for (int x = PART * part; x < min(width, PART * (part + 1)); ++x) {
    const int i = y * width + x;
    if (!valid[i]) continue;
    const float weight = relative_weight(guide + 3 * i);
    for (int c = 0; c < 3; ++c) error += weight * square(std_error[3 * i + c]);
    n += 1;
  }
  parts[2 * (y * n_parts + part)] = error;
  parts[2 * (y * n_parts + part) + 1] = n;
}
