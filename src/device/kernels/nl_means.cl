// SPDX-License-Identifier: Apache-2.0
// NL-means with auxiliary features, filters/nl_means.h: [RKZ2012] Eq. (1), features as in [RMZ2013],
//
//     d_ij = mean over 3 x 3 patch and RGB of ((f_i - f_j)^2 - (v_i + min(v_i, v_j))) / (v_i + v_j),
//     w_ij = exp(-max(d_ij / k^2, ||q_i - q_j||^2, 0)).
//
// A group of 32 x 8 items covers 32 x 32 pixels, of which the inner 30 x 30 are filtered; an item has four pixels of a
// column. For each offset o = j - i, items put the terms of their pixels into local memory, where patches are summed:
// first rows of three, then three of these. Two buffers take turns, so that one barrier per offset is enough.
//
// Options: GUIDES, images q (0 to 2); TASKS, bandwidths k of the same source (1 or 2); SOURCE, 1: another image than f
// is averaged.
// Compiled: GUIDES=1 TASKS=1 SOURCE=0
// Compiled: GUIDES=2 TASKS=2 SOURCE=0
// Compiled: GUIDES=2 TASKS=1 SOURCE=1
// Compiled: GUIDES=2 TASKS=2 SOURCE=1
#include "portable.h"
#include "pixels.h"

#define RADIUS 10
#define TILE 32
#define INNER 30
#define STRIP 4
#define OF_PATCH 27  // values in a patch
#define SMALLEST_VARIANCE 1e-10f
#define LARGEST_VARIANCE 1e30f

// v, from a standard error.
FUNCTION float variance_of(float error) { return min(error * error, LARGEST_VARIANCE) + SMALLEST_VARIANCE / 2; }

// One pixel's term of d_ij, a channel.
FUNCTION float term_of(float difference, float v, float u) {
  return (fma(difference, difference, -v) - min(v, u)) / (v + u);
}

#if GUIDES > 0
// ||q_i - q_j||^2 of an image multiplied by `scale`.
FUNCTION float guide_distance(GLOBAL const float* guide, float scale, int i, int j) {
  float sum = 0;
  for (int c = 0; c < 3; ++c) sum += square((guide[3 * i + c] - guide[3 * j + c]) * scale);
  return sum;
}
#endif

KERNEL nl_means(GLOBAL const float* image, GLOBAL const float* source, GLOBAL const float* std_error,
                GLOBAL const uchar* valid, GLOBAL const float* guide0, float unit0, GLOBAL const float* guide1,
                float unit1, int width, int height, float bandwidth0, float bandwidth1, GLOBAL float* results,
                int first0, int first1) {
  LOCAL_ARRAY(float, terms, 2 * TILE * TILE);
  const int column = get_local_id(0), strip = STRIP * get_local_id(1);
  const int x = get_group_id(0) * INNER - 1 + column, y = get_group_id(1) * INNER - 1 + strip;
  float own[STRIP][3], variance[STRIP][3], sums[STRIP][TASKS][4];
  for (int r = 0; r < STRIP; ++r) {
    const int i = 3 * (clamped(y + r, height) * width + clamped(x, width));
    for (int c = 0; c < 3; ++c) own[r][c] = image[i + c], variance[r][c] = variance_of(std_error[i + c]);
    for (int k = 0; k < TASKS; ++k)
      for (int c = 0; c < 4; ++c) sums[r][k][c] = 0;
  }
  const float scales[2] = {1 / (OF_PATCH * bandwidth0 * bandwidth0), 1 / (OF_PATCH * bandwidth1 * bandwidth1)};
  const int is_inside_tile = column >= 1 && column <= INNER && x < width;
  int turn = 0;
  for (int dy = -RADIUS; dy <= RADIUS; ++dy)
    for (int dx = -RADIUS; dx <= RADIUS; ++dx, turn ^= 1) {
      float averaged[STRIP][3];
      for (int r = 0; r < STRIP; ++r) {
        const int j = 3 * (clamped(y + r + dy, height) * width + clamped(x + dx, width));
        float sum = 0;
        for (int c = 0; c < 3; ++c) {
          const float there = image[j + c];
          averaged[r][c] = SOURCE ? source[j + c] : there;
          sum += term_of(own[r][c] - there, variance[r][c], variance_of(std_error[j + c]));
        }
        terms[(turn * TILE + strip + r) * TILE + column] = sum;
      }
      group_barrier();
      const int other_x = x + dx;
      if (!is_inside_tile || other_x < 0 || other_x >= width) continue;
      float rows[STRIP + 2];
      for (int r = 0; r < STRIP + 2; ++r) {
        const int place = (turn * TILE + clamped(strip - 1 + r, TILE)) * TILE + column;
        rows[r] = terms[place - 1] + terms[place] + terms[place + 1];
      }
      for (int r = 0; r < STRIP; ++r) {
        const int row = strip + r, other_y = y + r + dy;
        if (row < 1 || row > INNER || y + r >= height || other_y < 0 || other_y >= height) continue;
        const int j = other_y * width + other_x;
        if (!valid[j]) continue;
#if PLANTED_BUG
        const float patch = rows[r] + rows[r + 1];
#else
        const float patch = rows[r] + rows[r + 1] + rows[r + 2];
#endif
        float distance = 0;
#if GUIDES > 0
        distance = guide_distance(guide0, 1 / unit0, (y + r) * width + x, j);
#endif
#if GUIDES > 1
        distance += guide_distance(guide1, 1 / unit1, (y + r) * width + x, j);
#endif
        for (int k = 0; k < TASKS; ++k) {
          const float weight = exp_of_nonpositive(-max(max(patch * scales[k], distance), 0.0f));
          for (int c = 0; c < 3; ++c) sums[r][k][c] = fma(weight, averaged[r][c], sums[r][k][c]);
          sums[r][k][3] += weight;
        }
      }
    }
  if (!is_inside_tile) return;
  for (int r = 0; r < STRIP; ++r) {
    if (strip + r < 1 || strip + r > INNER || y + r >= height) continue;
    const int i = 3 * ((y + r) * width + x);
    for (int k = 0; k < TASKS; ++k)
      for (int c = 0; c < 3; ++c)
        results[(k == 0 ? first0 : first1) + i + c] =
            sums[r][k][3] > 0 ? sums[r][k][c] / sums[r][k][3] : SOURCE ? source[i + c] : own[r][c];
  }
}
