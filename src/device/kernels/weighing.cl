// SPDX-License-Identifier: Apache-2.0
// The network that weighs candidates, weighing/weighing.h: features of cells of 2 x 2 pixels, convolutional layers over
// planes of cells, and the candidates' mixture with the shares that follow. Planes lie one after another, without
// borders; sums have the processor's order.
//
// Options: M, number of candidates; SURFACES, 1: with albedo and normal; SIDE, of a convolution's square, 1 or 3.
// Compiled: M=4 SURFACES=1 SIDE=3
// Compiled: M=4 SURFACES=0 SIDE=1
#include "portable.h"
#include "pixels.h"

#define CELL 2
#define PIXELS (CELL * CELL)
#define LEAST_BRIGHTNESS 1e-10f
#define MOST_SQUARE 1e6f
#define OUTPUTS 4  // of a convolution, by one item

// The colours of a cell's pixels; beyond the image, those of its edge.
FUNCTION void read_cell(GLOBAL const float* image, int width, int height, int x, int y, float* cell) {
  for (int i = 0; i < PIXELS; ++i) {
    const int u = min(CELL * x + i % CELL, width - 1), v = min(CELL * y + i / CELL, height - 1);
    for (int c = 0; c < 3; ++c) cell[3 * i + c] = image[3 * ((size_t)v * width + u) + c];
  }
}

// From squares of any size to [-1, 1).
FUNCTION float rooted(float square) {
  const float root = sqrt(sqrt(min(square, MOST_SQUARE)));
  return 2 * root / (root + 0.3f) - 1;
}

FUNCTION void find_mean(const float* cell, float* mean) {
  for (int c = 0; c < 3; ++c) {
    mean[c] = 0;
    for (int i = 0; i < PIXELS; ++i) mean[c] += cell[3 * i + c];
    mean[c] /= PIXELS;
  }
}

// Mean square of the values times `scale`.
FUNCTION float mean_square(const float* values, float scale) {
  float sum = 0;
  for (int i = 0; i < 3 * PIXELS; ++i) sum += square(scale * values[i]);
  return sum / (3 * PIXELS);
}

FUNCTION void subtract(const float* other, float* cell) {
  for (int i = 0; i < 3 * PIXELS; ++i) cell[i] -= other[i];
}

FUNCTION void subtract_mean(const float* mean, float* cell) {
  for (int i = 0; i < 3 * PIXELS; ++i) cell[i] -= mean[i % 3];
}

// Mean brightness of the cell and those around, of which the edge is repeated.
FUNCTION float brightness_around(GLOBAL const float* image, int width, int height, int x, int y) {
  const int columns = (width + 1) / CELL, rows = (height + 1) / CELL;
  float all = 0;
  for (int j = y - 1; j <= y + 1; ++j)
    for (int i = x - 1; i <= x + 1; ++i) {
      float cell[3 * PIXELS], sum = 0;
      read_cell(image, width, height, clamped(i, columns), clamped(j, rows), cell);
      for (int k = 0; k < PIXELS; ++k) sum += max((cell[3 * k] + cell[3 * k + 1] + cell[3 * k + 2]) / 3, 0.0f);
      all += sum / PIXELS;
    }
  return max(all / 9, LEAST_BRIGHTNESS);
}

// The features of a cell, one item each; columns and rows: of the planes, which repeat the last cells.
// `candidates`: M images one after another; the second albedo and normal: behind mirrors and glass.
KERNEL weighing_features(GLOBAL const float* mean, GLOBAL const float* candidates, GLOBAL const float* std_error,
                         GLOBAL const float* albedo, GLOBAL const float* normal, GLOBAL const float* second_albedo,
                         GLOBAL const float* second_normal, int width, int height, int columns, int rows,
                         GLOBAL float* planes) {
  const int column = get_global_id(0), row = get_global_id(1);
  if (column >= columns || row >= rows) return;
  const int x = min(column, (width + 1) / CELL - 1), y = min(row, (height + 1) / CELL - 1);
  const size_t plane = (size_t)columns * rows;
  GLOBAL float* feature = planes + (size_t)row * columns + column;
  const float inverse = 1 / brightness_around(candidates, width, height, x, y);
  float base[3 * PIXELS], cell[3 * PIXELS], means[3];
  read_cell(candidates, width, height, x, y, base);
  for (int k = 0; k < M; ++k) {  // the mean, and all candidates but the first
    read_cell(k == 0 ? mean : candidates + (size_t)k * 3 * width * height, width, height, x, y, cell);
    subtract(base, cell);
    float sum = 0;
    for (int i = 0; i < 3 * PIXELS; ++i) sum += cell[i] * inverse;
    const float signed_mean = (4 + PLANTED_BUG) * (sum / (3 * PIXELS));
    *feature = signed_mean / (1 + fabs(signed_mean)), feature += plane;
    *feature = rooted(mean_square(cell, inverse)), feature += plane;
  }
  read_cell(std_error, width, height, x, y, cell);
  *feature = rooted(mean_square(cell, inverse)), feature += plane;
  find_mean(base, means);
  for (int c = 0; c < 3; ++c, feature += plane) {
    const float ratio = max(means[c], 0.0f) * inverse;
    *feature = ratio / (1 + ratio);
  }
  subtract_mean(means, base);
  *feature = rooted(mean_square(base, inverse)), feature += plane;
#if SURFACES
  float differences = 0, spreads[2];
  for (int k = 0; k < 2; ++k) {
    float second[3 * PIXELS];
    read_cell(k == 0 ? second_albedo : second_normal, width, height, x, y, second);
    read_cell(k == 0 ? albedo : normal, width, height, x, y, cell);
    subtract(second, cell);
    differences += mean_square(cell, 1);
    find_mean(second, means);
    for (int c = 0; c < 3; ++c, feature += plane) *feature = means[c];
    subtract_mean(means, second);
    spreads[k] = sqrt(mean_square(second, 1));
  }
  *feature = spreads[0], feature += plane;
  *feature = spreads[1], feature += plane;
  *feature = sqrt(differences), feature += plane;
  *feature = 1;
#else
  for (int i = 0; i < 10; ++i, feature += plane) *feature = 0;
#endif
}

// A layer: OUTPUTS of its outputs at a cell for each item, from the planes of two sources, zero beyond them. weights:
// [input][row][column][output], offsets: [output], outputs rounded up to OUTPUTS. is_positive: negative values become
// zero.
KERNEL convolve(GLOBAL const float* RESTRICT first, int n_first, GLOBAL const float* RESTRICT second, int n_second,
                GLOBAL const float* RESTRICT weights, GLOBAL const float* RESTRICT offsets, int n_outputs,
                int is_positive, int columns, int rows, GLOBAL float* RESTRICT result) {
  const int x = get_global_id(0), y = get_global_id(1), output = OUTPUTS * get_global_id(2);
  if (x >= columns || y >= rows) return;
  const int all_outputs = (n_outputs + OUTPUTS - 1) / OUTPUTS * OUTPUTS;
  const size_t plane = (size_t)columns * rows;
  float sums[OUTPUTS];
  for (int o = 0; o < OUTPUTS; ++o) sums[o] = offsets[output + o];
  GLOBAL const float* weight = weights + output;
  for (int i = 0; i < n_first + n_second; ++i) {
    GLOBAL const float* source = i < n_first ? first + i * plane : second + (i - n_first) * plane;
    for (int dy = -(SIDE / 2); dy <= SIDE / 2; ++dy)
      for (int dx = -(SIDE / 2); dx <= SIDE / 2; ++dx, weight += all_outputs) {
        const int is_inside = x + dx >= 0 && x + dx < columns && y + dy >= 0 && y + dy < rows;
        const float value = is_inside ? source[(size_t)(y + dy) * columns + x + dx] : 0.0f;
        for (int o = 0; o < OUTPUTS; ++o) sums[o] = fma(weight[o], value, sums[o]);
      }
  }
  for (int o = 0; o < OUTPUTS && output + o < n_outputs; ++o)
    result[(output + o) * plane + (size_t)y * columns + x] = is_positive ? max(sums[o], 0.0f) : sums[o];
}

// Means over 2 x 2 cells, and the opposite; columns and rows: of the result; one item for each cell of a plane.
KERNEL halve(GLOBAL const float* planes, int columns, int rows, GLOBAL float* result) {
  const int x = get_global_id(0), y = get_global_id(1), k = get_global_id(2);
  if (x >= columns || y >= rows) return;
  GLOBAL const float* above = planes + ((size_t)k * 2 * rows + 2 * y) * 2 * columns + 2 * x;
  GLOBAL const float* below = above + 2 * columns;
  result[((size_t)k * rows + y) * columns + x] = 0.25f * ((above[0] + above[1]) + (below[0] + below[1]));
}

KERNEL repeat(GLOBAL const float* planes, int columns, int rows, GLOBAL float* result) {
  const int x = get_global_id(0), y = get_global_id(1), k = get_global_id(2);
  if (x >= columns || y >= rows) return;
  result[((size_t)k * rows + y) * columns + x] = planes[((size_t)k * (rows / 2) + y / 2) * (columns / 2) + x / 2];
}

// Powers of four of y / 2 + sqrt(y^2 / 4 + 1) over their sum, in place; M + 1 planes.
KERNEL share_out(int n_cells, GLOBAL float* planes) {
  const int i = get_global_id(0);
  if (i >= n_cells) return;
  float powers[M + 1], sum = 0;
  for (int k = 0; k <= M; ++k) {
    const float value = planes[(size_t)k * n_cells + i];
    powers[k] = square(square(0.5f * value + sqrt(0.25f * value * value + 1)));
    sum += powers[k];
  }
  for (int k = 0; k <= M; ++k) planes[(size_t)k * n_cells + i] = powers[k] / sum;
}

// Image k's share at a pixel: bilinear interpolation between the cells of the image; `columns`, `rows`: of their planes.
FUNCTION float share_at(GLOBAL const float* shares, int k, int x, int y, int columns, int rows) {
  const int x0 = x / CELL, x1 = clamped(x % CELL == 0 ? x0 - 1 : x0 + 1, columns);
  const int y0 = y / CELL, y1 = clamped(y % CELL == 0 ? y0 - 1 : y0 + 1, rows);
  GLOBAL const float* near = shares + ((size_t)k * rows + y0) * columns;
  GLOBAL const float* far = shares + ((size_t)k * rows + y1) * columns;
  return 0.75f * (0.75f * near[x0] + 0.25f * near[x1]) + 0.25f * (0.75f * far[x0] + 0.25f * far[x1]);
}

// The mixture of the mean and the candidates, as one more candidate behind them.
KERNEL weigh(GLOBAL const float* mean, GLOBAL const float* shares, int width, int height, int columns, int rows,
             GLOBAL float* candidates) {
  const int x = get_global_id(0), y = get_global_id(1);
  if (x >= width || y >= height) return;
  const size_t i = 3 * ((size_t)y * width + x), image = 3 * (size_t)width * height;
  float sum[3] = {0, 0, 0};
  for (int k = 0; k <= M; ++k) {
    const float share = share_at(shares, k, x, y, columns, rows);
    GLOBAL const float* rgb = k == 0 ? mean + i : candidates + (k - 1) * image + i;
    for (int c = 0; c < 3; ++c) sum[c] += share * rgb[c];
  }
  for (int c = 0; c < 3; ++c) candidates[M * image + i + c] = sum[c];
}

// The weights of the M candidates in a mixture whose last candidate is that of weigh(): their own, and their shares in
// it. weights: of M + 1 candidates, one image after another.
KERNEL share_weight(GLOBAL const float* shares, GLOBAL const float* weights, int width, int height, int columns,
                    int rows, GLOBAL float* shared) {
  const int x = get_global_id(0), y = get_global_id(1);
  if (x >= width || y >= height) return;
  const size_t i = (size_t)y * width + x, image = (size_t)width * height;
  for (int k = 0; k < M; ++k)
    shared[k * image + i] =
        weights[k * image + i] + share_at(shares, k + 1 - PLANTED_BUG, x, y, columns, rows) * weights[M * image + i];
}
