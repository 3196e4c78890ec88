// SPDX-License-Identifier: Apache-2.0
// Input-dependent uncorrelated weighting [Back2023]: estimators/iduw.h and .cpp, whose names these are. z: means of the
// CRN image, y: of the independent one; of all groups, of two halves, and of four quarters.
//
// Definitions: RADIUS of the window; GAMMAS, the number of candidates; GROUPS and COUNTS, of the image whose means are
// found.
// Compiled: RADIUS=7 GAMMAS=10 GROUPS=12 COUNTS=0
#include "portable.h"
#include "groups.h"

#define LOG2_E 1.44269504f
#define NORMALISE (1.0f / (float)((2 * RADIUS + 1) * (2 * RADIUS + 1) - 1))

// 1 for pixels whose values are all usable, and which were before.
KERNEL find_usable(GLOBAL const float* RESTRICT groups, int n, GLOBAL uchar* RESTRICT valid) {
  const int i = get_global_id(0);
  if (i < n) valid[i] = valid[i] && are_usable(groups + (size_t)i * (3 * GROUPS), 3 * GROUPS);
}

// Means of the groups first, first + step, …; `invalid` at pixels that are not usable. Three floats a pixel.
KERNEL group_means(GLOBAL const float* RESTRICT groups, GLOBAL const uint* RESTRICT counts,
                   GLOBAL const uchar* RESTRICT valid, int n, int first, int step, float invalid,
                   GLOBAL float* RESTRICT means) {
  const int i = get_global_id(0);
  if (i >= n) return;
  float mean[3] = {invalid, invalid, invalid}, variance[3];
  if (valid[i])
    moments_of(groups + (size_t)i * (3 * GROUPS), GROUPS, COUNTS ? counts[i] : GROUPS, first, step, mean, variance);
  for (int c = 0; c < 3; ++c) means[3 * (size_t)i + c] = mean[c];
}

// Column or row i of n, reflected at the outermost ones (… 2 1 | 0 1 2 …), repeatedly.
FUNCTION int reflected(int i, int n) {
  if (n == 1) return 0;
  const int period = 2 * (n - 1), j = ((i % period) + period) % period;
  return j < n ? j : period - j;
}

// e^x for x <= 0.
FUNCTION float exp_of_nonpositive(float x) { return exp2_of_nonpositive(x * LOG2_E); }

// Squared relative difference of the two halves' results for each gamma, summed over RGB, one item a pixel: at
// i * pixels + pixel. `z_quarters`: [half][quarter], one after another; `scale`: -n.
KERNEL iduw_losses(GLOBAL const float* RESTRICT y_all, GLOBAL const float* RESTRICT z_half_0,
                   GLOBAL const float* RESTRICT z_half_1, GLOBAL const float* RESTRICT y_half_0,
                   GLOBAL const float* RESTRICT y_half_1, GLOBAL const float* RESTRICT z_quarter_00,
                   GLOBAL const float* RESTRICT z_quarter_01, GLOBAL const float* RESTRICT z_quarter_10,
                   GLOBAL const float* RESTRICT z_quarter_11, GLOBAL const float* RESTRICT gammas, int width,
                   int height, float scale, GLOBAL float* RESTRICT losses) {
  const int x = get_global_id(0), y = get_global_id(1);
  if (x >= width || y >= height) return;
  const size_t pixel = (size_t)y * width + x;
  float loss[GAMMAS];
  for (int i = 0; i < GAMMAS; ++i) loss[i] = 0.0f;
  for (int c = 0; c < 3; ++c) {
    const size_t p = 3 * pixel + c;
    float sums_0[GAMMAS], sums_1[GAMMAS];
    for (int i = 0; i < GAMMAS; ++i) sums_0[i] = sums_1[i] = 0.0f;
    const float q00 = z_quarter_00[p], q01 = z_quarter_01[p], q10 = z_quarter_10[p], q11 = z_quarter_11[p];
    const float centre_0 = z_half_0[p] - y_half_0[p], centre_1 = z_half_1[p] - y_half_1[p];
    float box = y_all[p];
    for (int dy = -RADIUS; dy <= RADIUS; ++dy)
      for (int dx = -RADIUS; dx <= RADIUS; ++dx) {
        if (dx == 0 && dy == 0) continue;
        const size_t q = 3 * ((size_t)reflected(y + dy, height) * width + reflected(x + dx, width)) + c;
        box += y_all[q];
        const float change_0 = (q00 - z_quarter_00[q]) - (q01 - z_quarter_01[q]);
        const float change_1 = (q10 - z_quarter_10[q]) - (q11 - z_quarter_11[q]);
        const float difference_0 = centre_0 - (z_half_0[q] - y_half_0[q]);
        const float difference_1 = centre_1 - (z_half_1[q] - y_half_1[q]);
        const float exponent_0 = scale * change_0 * change_0, exponent_1 = scale * change_1 * change_1;
        for (int i = 0; i < GAMMAS; ++i) {
          sums_0[i] = fma(exp_of_nonpositive(gammas[i] * exponent_0), difference_0, sums_0[i]);
          sums_1[i] = fma(exp_of_nonpositive(gammas[i] * exponent_1), difference_1, sums_1[i]);
        }
      }
    box *= 1.0f / (float)((2 * RADIUS + 1) * (2 * RADIUS + 1));
    const float denominator = box * box + 0.01f, base = y_half_0[p] - y_half_1[p];
    for (int i = 0; i < GAMMAS; ++i) {
      const float difference = base + NORMALISE * (sums_0[i] - sums_1[i]);
      loss[i] += difference * difference / denominator;
    }
  }
  for (int i = 0; i < GAMMAS; ++i) losses[i * ((size_t)width * height) + pixel] = loss[i];
}

// The sum of each row, one item for each row of each gamma's losses.
KERNEL sum_rows(GLOBAL const float* RESTRICT losses, int width, int rows, GLOBAL float* RESTRICT sums) {
  const int row = get_global_id(0);
  if (row >= rows) return;
  float sum = 0.0f;
  for (int x = 0; x < width; ++x) sum += losses[(size_t)row * width + x];
  sums[row] = sum;
}

// The estimate, one item a pixel. `scale`: -gamma n.
KERNEL iduw(GLOBAL const float* RESTRICT z_all, GLOBAL const float* RESTRICT y_all,
            GLOBAL const float* RESTRICT z_half_0, GLOBAL const float* RESTRICT z_half_1, int width, int height,
            float scale, GLOBAL float* RESTRICT estimate) {
  const int x = get_global_id(0), y = get_global_id(1);
  if (x >= width || y >= height) return;
  for (int c = 0; c < 3; ++c) {
    const size_t p = 3 * ((size_t)y * width + x) + c;
    const float a = z_half_0[p], b = z_half_1[p], centre = z_all[p] - y_all[p];
    float sum = 0.0f;
    for (int dy = -RADIUS; dy <= RADIUS; ++dy)
      for (int dx = -RADIUS; dx <= RADIUS; ++dx) {
        if (dx == 0 && dy == 0) continue;
        const size_t q = 3 * ((size_t)reflected(y + dy, height) * width + reflected(x + dx, width)) + c;
        const float change = (a - z_half_0[q]) - (b - z_half_1[q]);
        const float weight = exp_of_nonpositive(scale * change * change);  // [Back2023], as in iduw.h
        sum = fma(weight, centre - (z_all[q] - y_all[q]), sum);
      }
    estimate[p] = y_all[p] + NORMALISE * (1.0f + PLANTED_BUG) * sum;
  }
}
