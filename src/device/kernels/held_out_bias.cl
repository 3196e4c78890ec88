// SPDX-License-Identifier: Apache-2.0
// The bias of an image where it is significant, risk/held_out_bias.h: means of r = M - h over cells of 4 x 4 pixels that
// look alike in the other half,
//
//     d_A,i = sum_j w_ij r_A,j / sum_j w_ij,   w_ij = exp(-||G_B,j - G_B,i||^2 / ((0.5 G'_B,i)^2 + 1e-4)).
#include "portable.h"
#include "groups.h"
#include "pixels.h"

#define CELL 4
#define PIXELS 16
#define BANDWIDTH 0.5f
#define LEAST_SQUARE 1e-4f
#define SIGNIFICANT 3  // standard errors
#define FEWEST_CELLS 20
#define LEAST_RELATIVE 1e-4f
// Planes of cells: guides of both halves (FAR without valid pixels), sums of M - h of both, half the square of their
// difference, the same with the weight of relMSE, number of valid pixels.
#define GUIDE 0
#define RESIDUAL 6
#define SQUARE 12
#define RELATIVE 15
#define COUNT 18
#define PLANES 19

KERNEL bias_cells(GLOBAL const float* half_a, GLOBAL const float* half_b, GLOBAL const float* guide_a,
                  GLOBAL const float* guide_b, GLOBAL const float* h_a, GLOBAL const float* h_b,
                  GLOBAL const uchar* valid, int width, int height, GLOBAL float* cells) {
  const int columns = (width + CELL - 1) / CELL, rows = (height + CELL - 1) / CELL;
  const int column = get_global_id(0), row = get_global_id(1);
  if (column >= columns || row >= rows) return;
  float guide[6], residual[6], n = 0;
  for (int k = 0; k < 6; ++k) guide[k] = residual[k] = 0;
  for (int y = CELL * row; y < min(height, CELL * (row + 1)); ++y)
    for (int x = CELL * column; x < min(width, CELL * (column + 1)); ++x) {
      const int i = y * width + x;
      if (!valid[i]) continue;
      n += 1;
      for (int c = 0; c < 3; ++c) {
        guide[c] += guide_a[3 * i + c];
        guide[3 + c] += guide_b[3 * i + c];
        residual[c] += half_a[3 * i + c] - h_a[3 * i + c];
        residual[3 + c] += half_b[3 * i + c] - h_b[3 * i + c];
      }
    }
  const size_t plane = (size_t)rows * columns;
  GLOBAL float* cell = cells + (size_t)row * columns + column;
  float grey = 0;
  for (int k = 0; k < 6; ++k) grey += n > 0 ? guide[k] / n / 6 : 0.0f;
  const float weight = 1 / (square(grey) + 0.01f);
  for (int k = 0; k < 6; ++k) {
    cell[(GUIDE + k) * plane] = n > 0 ? guide[k] / n : FAR;
    cell[(RESIDUAL + k) * plane] = residual[k];
  }
  for (int c = 0; c < 3; ++c) {
    const float squares = 0.5f * square(residual[c] - residual[3 + c]);
    cell[(SQUARE + c) * plane] = squares;
    cell[(RELATIVE + c) * plane] = squares * weight;
  }
  cell[COUNT * plane] = n;
}

// d and v of a half, 0 or 1, around a cell, in mean and variance; returns the effective number of cells.
FUNCTION float guided_mean(GLOBAL const float* cells, int which, int radius, int column, int row, int columns, int rows,
                           float* mean, float* variance) {
  const size_t plane = (size_t)rows * columns;
  const int guide = GUIDE + 3 * (1 - which), residual = RESIDUAL + 3 * which;
  float own[3], relative[3] = {0, 0, 0}, weights = 0, squares = 0, counts = 0;
  for (int c = 0; c < 3; ++c) {
    own[c] = cells[(guide + c) * plane + (size_t)row * columns + column];
    mean[c] = variance[c] = 0;
  }
  const float grey = (own[0] + own[1] + own[2]) / 3, bandwidth = square(BANDWIDTH * grey) + LEAST_SQUARE;
  for (int v = max(0, row - radius); v <= min(rows - 1, row + radius); ++v)
    for (int u = max(0, column - radius); u <= min(columns - 1, column + radius); ++u) {
      GLOBAL const float* cell = cells + (size_t)v * columns + u;
      const float count = cell[COUNT * plane];
      const float weight = alike(cell[guide * plane] - own[0], cell[(guide + 1) * plane] - own[1],
                                 cell[(guide + 2) * plane] - own[2], bandwidth);
      weights += weight * count;
      squares += weight * weight * count * count;
      counts += count;
      for (int c = 0; c < 3; ++c) {
        mean[c] += weight * cell[(residual + c) * plane];
        variance[c] += weight * weight * cell[(SQUARE + c) * plane];
        relative[c] += cell[(RELATIVE + c) * plane];
      }
    }
  const float inverse = 1 / max(weights, 1e-20f);
  const float per_cell = squares * (grey * grey + 0.01f) / max(counts * PIXELS, 1e-20f);
  for (int c = 0; c < 3; ++c) {
    mean[c] *= inverse;
    variance[c] = max(variance[c], relative[c] * per_cell) * inverse * inverse;
  }
  return weights * weights / max(squares, 1e-20f);
}

// The bias of each cell, three channels; zero where it is not significant.
KERNEL bias_of_cells(GLOBAL const float* cells, int columns, int rows, GLOBAL float* biases) {
  const int column = get_global_id(0), row = get_global_id(1), i = row * columns + column;
  if (column >= columns || row >= rows) return;
  const size_t plane = (size_t)rows * columns;
  float bias[3] = {0, 0, 0}, brightness = 0;
  for (int k = 0; k < 6; ++k) brightness += cells[(GUIDE + k) * plane + i] / 6;
  for (int radius = 3; radius <= 7 && cells[COUNT * plane + i] > 0; radius += 4) {
    float mean_a[3], mean_b[3], variance_a[3], variance_b[3];
    const float n_a = guided_mean(cells, 0, radius, column, row, columns, rows, mean_a, variance_a);
    const float n_b = guided_mean(cells, 1, radius, column, row, columns, rows, mean_b, variance_b);
    for (int c = 0; c < 3; ++c) {
      if (bias[c] != 0) continue;
      const float variance = 0.25f * (variance_a[c] + variance_b[c]), b = 0.5f * (mean_a[c] + mean_b[c]);
      const float squares = b * b, least = LEAST_RELATIVE * brightness;
#if PLANTED_BUG
      const float significant = SIGNIFICANT * variance;
#else
      const float significant = SIGNIFICANT * SIGNIFICANT * variance;
#endif
      if (squares > significant && square(mean_a[c] - mean_b[c]) < squares && squares > least * least &&
          min(n_a, n_b) > FEWEST_CELLS)
        bias[c] = b - variance / b;
    }
  }
  for (int c = 0; c < 3; ++c) biases[3 * i + c] = bias[c];
}

KERNEL bias_of_pixels(GLOBAL const float* biases, GLOBAL const uchar* valid, int width, int height,
                      GLOBAL float* result) {
  const int x = get_global_id(0), y = get_global_id(1), i = y * width + x;
  if (x >= width || y >= height) return;
  const int cell = y / CELL * ((width + CELL - 1) / CELL) + x / CELL;
  for (int c = 0; c < 3; ++c) result[3 * i + c] = valid[i] ? biases[3 * cell + c] : 0.0f;
}
