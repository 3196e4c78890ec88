// SPDX-License-Identifier: Apache-2.0
// Nonlinearly weighted first-order regression, collaborative, filters/regression.h: [Bitterli2016] Eqs. (5) and (6).
// A group fits the model of one window of 21 x 21 pixels,
//
//     minimise sum_j w_ij ((s_j - a_i - b_i (x_j - x_i))^2 + r ||b_i||^2),
//
// whose weights and models are kept; then every pixel gathers the predictions of the windows around. Windows begin every
// `step` pixels; they come in bands of rows, so that their weights fit into memory.
//
// Terms of a model: constant, column, row, features. With the three colours they are vectors of 441 values, whose inner
// products are summed in tiles of 3 x 3, each by SLICES items that take turns with pixels.
//
// Options: TERMS, number of terms, a multiple of 3; FIRST_OF_POSITION, of the last three, or TERMS.
// Compiled: TERMS=9 FIRST_OF_POSITION=9
// Compiled: TERMS=15 FIRST_OF_POSITION=12
#include "portable.h"
#include "pixels.h"

#define RADIUS 10
#define SIDE 21
#define PIXELS 441
#define BORDERED 23  // with the pixels that complete patches
#define ITEMS 128
#define ROWS 3  // of a window, whose terms are in local memory together
#define VECTORS (TERMS + 3)
#define BLOCKS (VECTORS / 3)
#define TILES (BLOCKS * (BLOCKS + 1) / 2)
#define SLICES (ITEMS / TILES)
#define FEATURES (TERMS - 3)
#define OF_PATCH 27
#define BANDWIDTH 0.5f
#define AT(row, column) matrix[(row) * VECTORS + (column)]
#define PLACE_UNIT 6  // pixels per unit of position
#define RIDGE 5e-4f
#define RIDGE_OF_POSITION 1e-3f
#define SMALLEST_VARIANCE 1e-10f
#define LARGEST_VARIANCE 1e30f

// The row of blocks of a tile, of up to six; row r begins with tile r (r + 1) / 2.
FUNCTION int row_of_tile(int tile) { return (tile >= 1) + (tile >= 3) + (tile >= 6) + (tile >= 10) + (tile >= 15); }

// Copies channels of an image to those of `features` from `first` on.
KERNEL set_features(GLOBAL const float* image, int first, int n_features, int n_pixels, GLOBAL float* features) {
  const int i = get_global_id(0);
  if (i >= n_pixels) return;
  for (int c = 0; c < 3; ++c) features[i * n_features + first + c] = image[3 * i + c];
}

KERNEL clear(int n, GLOBAL float* values) {
  const int i = get_global_id(0);
  if (i < n) values[i] = 0;
}

// source: what is fitted, with the weights of `image`.
KERNEL fit_windows(GLOBAL const float* image, GLOBAL const float* source, GLOBAL const float* std_error,
                        GLOBAL const uchar* valid, GLOBAL const float* features, int width, int height, int step, int first_row, int columns,
                        GLOBAL float* weights, GLOBAL float* models) {
  LOCAL_ARRAY(float, colours, BORDERED * BORDERED * 3);
  LOCAL_ARRAY(float, variances, BORDERED * BORDERED * 3);
  LOCAL_ARRAY(float, roots, PIXELS);
  LOCAL_ARRAY(float, terms, ROWS * SIDE * VECTORS);
  LOCAL_ARRAY(float, parts, ITEMS * 9);
  LOCAL_ARRAY(float, matrix, VECTORS * VECTORS);
  LOCAL_ARRAY(float, shift, TERMS);
  LOCAL_ARRAY(float, inverse, TERMS);
  const int item = get_local_id(0), window_x = get_group_id(0), window_y = get_group_id(1);
  const int x = step * window_x + 1, y = step * (first_row + window_y) + 1;
  const int centre = clamped(y, height) * width + clamped(x, width);

  // 1. The pixels of the window; beyond the frame, its outermost.
  for (int i = item; i < BORDERED * BORDERED; i += ITEMS) {
    const int u = clamped(x + i % BORDERED - RADIUS - 1, width), v = clamped(y + i / BORDERED - RADIUS - 1, height);
    for (int c = 0; c < 3; ++c) {
      const float error = std_error[3 * (v * width + u) + c];
      colours[3 * i + c] = image[3 * (v * width + u) + c];
      variances[3 * i + c] = min(error * error, LARGEST_VARIANCE) + SMALLEST_VARIANCE / 2;
    }
  }
  group_barrier();

  // 2. Roots of the weights of NL-means, without features.
  for (int j = item; j < PIXELS; j += ITEMS) {
    const int dx = j % SIDE - RADIUS, dy = j / SIDE - RADIUS;
    float root = 0;
    if (x + dx >= 0 && x + dx < width && y + dy >= 0 && y + dy < height && valid[(y + dy) * width + x + dx]) {
      float sum = 0;
      for (int py = -1; py <= 1; ++py)
        for (int px = -1; px <= 1; ++px)
          for (int c = 0; c < 3; ++c) {
            const int own = 3 * ((RADIUS + 1 + py) * BORDERED + RADIUS + 1 + px) + c;
            const int other = own + 3 * (dy * BORDERED + dx);
            const float d = colours[own] - colours[other], p = variances[own], q = variances[other];
            sum += (fma(d, d, -p) - min(p, q)) / (p + q);
          }
      root = exp_of_nonpositive(min(-0.5f * sum / (OF_PATCH * BANDWIDTH * BANDWIDTH), 0.0f));
    }
    roots[j] = root;
    weights[((size_t)window_y * columns + window_x) * PIXELS + j] = root * root;
  }

  // 3. Inner products. Vectors a and b, from 3 block_a and 3 block_b on, b <= a.
  const int tile = item % TILES, slice = item / TILES;
  const int block_a = row_of_tile(tile), block_b = tile - block_a * (block_a + 1) / 2;
  float products[9];
  for (int k = 0; k < 9; ++k) products[k] = 0;
  for (int row = 0; row < SIDE; row += ROWS) {
    group_barrier();
    for (int k = item; k < ROWS * SIDE * VECTORS; k += ITEMS) {
      const int j = row * SIDE + k / VECTORS, term = k % VECTORS;
      const int dx = j % SIDE - RADIUS, dy = j / SIDE - RADIUS;
      const int there = clamped(y + dy, height) * width + clamped(x + dx, width);
      float value = 1;
      if (term == 1) value = (float)dx / PLACE_UNIT;
      if (term == 2) value = (float)dy / PLACE_UNIT;
      if (term >= 3 && term < TERMS)
        value = features[there * FEATURES + term - 3] - features[centre * FEATURES + term - 3];
      if (term >= TERMS) value = source[3 * there + term - TERMS];
      terms[k] = roots[j] * value;
    }
    group_barrier();
    for (int j = slice; j < ROWS * SIDE && slice < SLICES; j += SLICES) {
      float a[3], b[3];
      for (int k = 0; k < 3; ++k) {
        a[k] = terms[j * VECTORS + 3 * block_a + k];
        b[k] = terms[j * VECTORS + 3 * block_b + k];
      }
      for (int k = 0; k < 9; ++k) products[k] = fma(a[k / 3], b[k % 3], products[k]);
    }
  }
  for (int k = 0; k < 9; ++k) parts[item * 9 + k] = products[k];
  group_barrier();
  for (int k = item; k < TILES * 9; k += ITEMS) {
    float sum = 0;
    for (int s = 0; s < SLICES; ++s) sum += parts[(s * TILES + k / 9) * 9 + k % 9];
    const int a = row_of_tile(k / 9), b = k / 9 - a * (a + 1) / 2;
    AT(3 * a + k % 9 / 3, 3 * b + k % 3) = sum;
  }
  group_barrier();

  // 4. Ridges; the first inner product is the sum of the weights.
  for (int a = item; a < TERMS; a += ITEMS) {
    const float total = AT(0, 0);
    float ridge = max(total * RIDGE, 1e-30f);
    if (a == 0) ridge = max(total * 1e-6f, 1e-30f);
    if (a >= FIRST_OF_POSITION) ridge = max(AT(a, a) * RIDGE_OF_POSITION, total * 1e-12f + 1e-30f);
#if PLANTED_BUG
    ridge *= 100;
#endif
    shift[a] = ridge;
  }
  group_barrier();

  // 5. Cholesky factor L of the shifted matrix, column by column; the rows of the colours become L^-1 of theirs.
  for (int j = 0; j < TERMS; ++j) {
    const float inverted = rsqrt(max(AT(j, j) + shift[j], shift[j]));
    if (item == 0) inverse[j] = inverted;
    for (int a = j + 1 + item; a < VECTORS; a += ITEMS) AT(a, j) *= inverted;
    group_barrier();
    const int n = VECTORS - 1 - j;
    for (int k = item; k < n * n; k += ITEMS) {
      const int a = j + 1 + k / n, b = j + 1 + k % n;
      if (b <= a && b < TERMS) AT(a, b) -= AT(a, j) * AT(b, j);
    }
    group_barrier();
  }

  // 6. Back substitution for the three colours, x = L^-T x.
  for (int j = TERMS - 1; j >= 0; --j) {
    if (item < 3) AT(TERMS + item, j) *= inverse[j];
    group_barrier();
    for (int k = item; k < 3 * j; k += ITEMS) AT(TERMS + k / j, k % j) -= AT(j, k % j) * AT(TERMS + k / j, j);
    group_barrier();
  }

  // 7. From differences to the centre to values.
  if (item < 3) {
    float value = AT(TERMS + item, 0);
    for (int a = 3; a < TERMS; ++a) value -= AT(TERMS + item, a) * features[centre * FEATURES + a - 3];
    AT(TERMS + item, 0) = value;
  }
  group_barrier();
  for (int k = item; k < 3 * TERMS; k += ITEMS)
    models[((size_t)window_y * columns + window_x) * (3 * TERMS) + k] = AT(TERMS + k / TERMS, k % TERMS);
}

// Adds the predictions of a band's windows, with their weights, to the sums of each pixel: three colours and a weight.
KERNEL add_predictions(GLOBAL const float* weights, GLOBAL const float* models, GLOBAL const float* features,
                            int width, int height, int step, int first_row, int n_rows, int columns, int first_y,
                            GLOBAL float* sums) {
  const int x = get_global_id(0), y = first_y + (int)get_global_id(1), i = y * width + x;
  if (x >= width || y >= height) return;
  float own[FEATURES], sum[4];
  for (int a = 0; a < FEATURES; ++a) own[a] = features[i * FEATURES + a];
  for (int c = 0; c < 4; ++c) sum[c] = sums[4 * i + c];
  // Centres step w + 1 from y - RADIUS to y + RADIUS.
  const int top = max((y - RADIUS - 1 + step - 1 + step * RADIUS) / step - RADIUS, first_row);
  const int left = max((x - RADIUS - 1 + step - 1 + step * RADIUS) / step - RADIUS, 0);
  for (int v = top; v < first_row + n_rows && step * v + 1 <= y + RADIUS; ++v)
    for (int u = left; u < columns && step * u + 1 <= x + RADIUS; ++u) {
      const size_t window = (size_t)(v - first_row) * columns + u;
      const int dx = x - step * u - 1, dy = y - step * v - 1;
      const float weight = weights[window * PIXELS + (dy + RADIUS) * SIDE + dx + RADIUS];
      sum[3] += weight;
      for (int c = 0; c < 3; ++c) {
        GLOBAL const float* model = models + window * (3 * TERMS) + c * TERMS;
        float value = model[0] + model[1] * ((float)dx / PLACE_UNIT) + model[2] * ((float)dy / PLACE_UNIT);
        for (int a = 0; a < FEATURES; ++a) value = fma(model[3 + a], own[a], value);
        sum[c] = fma(weight, value, sum[c]);
      }
    }
  for (int c = 0; c < 4; ++c) sums[4 * i + c] = sum[c];
}

// The mean of the predictions and of another filter's image, which counts as one prediction with weight 1.
KERNEL finish_regression(GLOBAL const float* sums, GLOBAL const float* other, int first_of_other,
                              GLOBAL const uchar* valid, int n_pixels, GLOBAL float* result) {
  const int i = get_global_id(0);
  if (i >= n_pixels) return;
  for (int c = 0; c < 3; ++c) {
    const float value = other[first_of_other + 3 * i + c];
    result[3 * i + c] = valid[i] ? (sums[4 * i + c] + value) / (sums[4 * i + 3] + 1) : value;
  }
}
