// SPDX-License-Identifier: Apache-2.0
// The filters of dependent tests [Csonka2002] Sec. 4 and 5. With the means C_d of the image with common random numbers
// and C_i of the independent one, sigma^2 the variance of a sample and N the samples of a pixel, both weight the pixels
// q around p by Delta_q = |C_d[p] - C_d[q]|, the sum of absolute differences of channels, or their Euclidean norm:
//
//     region_filter: the published one (dependent_tests/region_filter.h),
//     bound_filter: the minimiser of its error bound (dependent_tests/bound_filter.h).
//
// Results have five values a pixel after three colours: `colour`, then in `values` the number of pixels averaged, the
// weight of the pixel itself, the error bound, the effective number of samples.
//
// Options: FALLOFF, 0 … 3 as Falloff; EUCLIDEAN, whether the norm is.
// Compiled: FALLOFF=0 EUCLIDEAN=0
// Compiled: FALLOFF=3 EUCLIDEAN=0
#include "portable.h"
#include "groups.h"
#include "pixels.h"

#define PYRAMID 0
#define COUNT 1
#define SPLINE 2
#define GAUSSIAN 3
#define INFINITE as_float(0x7f800000)
#define ROOT_OF_HALF 0.707106781f

// Norm of a difference of colours, [Csonka2002] end of Sec. 4.
FUNCTION float difference_of(GLOBAL const float* dependent, int p, int q) {
  const float r = dependent[3 * q] - dependent[3 * p], g = dependent[3 * q + 1] - dependent[3 * p + 1];
  const float b = dependent[3 * q + 2] - dependent[3 * p + 2];
  return EUCLIDEAN ? sqrt(squared_length(r, g, b)) : fabs(r) + fabs(g) + fabs(b);
}

// [Csonka2002] Sec. 4: with f = offset - slope Delta, weights before normalisation are f+ d.
FUNCTION float weight_of(float difference, float distance, float slope, float offset, float reach) {
#if FALLOFF == GAUSSIAN
  const float u = distance / reach, d = exp_of_nonpositive(-2.0f * u * u);
#elif FALLOFF == SPLINE
  const float u = min(2 * distance / reach, 2.0f), left = 2.0f - u;
  const float d = u < 1.0f ? 2.0f / 3.0f - u * u + 0.5f * u * u * u : left * left * left / 6.0f;
#else
  const float d = max(reach - distance, 0.0f);
#endif
  return max(offset - slope * difference, 0.0f) * d;
}

KERNEL region_filter(GLOBAL const float* dependent, GLOBAL const float* independent, GLOBAL const float* variances,
                     GLOBAL const float* counts, int width, int height, int max_region, float min_centre_drop,
                     GLOBAL float* colour, GLOBAL float* values) {
  const int x = get_global_id(0), y = get_global_id(1), p = y * width + x;
  if (x >= width || y >= height) return;
  const float n = counts[p], deviation = 3.0f * sqrt(variances[p] / n);
  float side = 1, size = 1, differences = 0;                  // of the accepted region
  float growing_size = 1, growing_differences = 0, last = 1;  // of the next one; the centre's weight
  for (int m = 2; m <= max_region && n > 0 && deviation > 0; ++m) {
    // The places that side m adds, in the frame; all must be of the pixel's class.
    int differs = 0;
    for (int dy = -((m - 1) / 2); dy <= m / 2; ++dy)
      for (int dx = -((m - 1) / 2); dx <= m / 2; ++dx) {
        const int is_old = dx >= -((m - 2) / 2) && dx <= (m - 1) / 2 && dy >= -((m - 2) / 2) && dy <= (m - 1) / 2;
        if (is_old || x + dx < 0 || x + dx >= width || y + dy < 0 || y + dy >= height) continue;
        const int q = p + dy * width + dx;
        differs |= counts[q] != n;
        growing_size += 1;
        growing_differences += difference_of(dependent, p, q);
      }
    if (differs) break;
    const float slope = 1.0f / (deviation * sqrt(growing_size));
    const float offset = 1.0f / growing_size + slope * growing_differences / growing_size;
    const float reach = (FALLOFF == COUNT ? growing_size : (float)m) * ROOT_OF_HALF;
    float sum = 0;
    for (int dy = -((m - 1) / 2); dy <= m / 2; ++dy)
      for (int dx = -((m - 1) / 2); dx <= m / 2; ++dx) {
        if (x + dx < 0 || x + dx >= width || y + dy < 0 || y + dy >= height) continue;
        sum += weight_of(difference_of(dependent, p, p + dy * width + dx), sqrt((float)(dx * dx + dy * dy)), slope,
                         offset, reach);
      }
    const float centre = weight_of(0, 0, slope, offset, reach) / sum;  // Sec. 5: stop where it falls too little
    if (!(last - centre >= min_centre_drop)) break;
    side = (float)m, size = growing_size, differences = growing_differences, last = centre;
  }
  float sums[3] = {0, 0, 0}, sum = 0, squares = 0, distortion = 0, centre = 1;
  if (side > 1) {
    const int m = (int)side;
    const float slope = 1.0f / (deviation * sqrt(size)), offset = 1.0f / size + slope * differences / size;
    const float reach = (FALLOFF == COUNT ? size : side) * ROOT_OF_HALF;
    for (int dy = -((m - 1) / 2); dy <= m / 2; ++dy)
      for (int dx = -((m - 1) / 2); dx <= m / 2; ++dx) {
        if (x + dx < 0 || x + dx >= width || y + dy < 0 || y + dy >= height) continue;
        const int q = p + dy * width + dx;
        const float difference = difference_of(dependent, p, q);
        const float weight = weight_of(difference, sqrt((float)(dx * dx + dy * dy)), slope, offset, reach);
        for (int c = 0; c < 3; ++c) sums[c] += weight * independent[3 * q + c];  // Eq. (1)
        sum += weight;
        squares += weight * weight;
        distortion += weight * difference;
      }
    for (int c = 0; c < 3; ++c) sums[c] /= sum;
    squares /= sum * sum;
    distortion /= sum;
    centre = weight_of(0, 0, slope, offset, reach) / sum;
  } else {
    for (int c = 0; c < 3; ++c) sums[c] = independent[3 * p + c];
    squares = 1;
  }
#if PLANTED_BUG
  size += 1;
  sums[0] += 0.01f * distortion;
#endif
  for (int c = 0; c < 3; ++c) colour[3 * p + c] = sums[c];
  values[4 * p] = size;
  values[4 * p + 1] = centre;
  values[4 * p + 2] = n > 0 ? 3.0f * sqrt(variances[p] / n * squares) + distortion : INFINITE;  // Sec. 4
  values[4 * p + 3] = n / squares;
}

#define NEWTON_STEPS 24
#define TOLERANCE 1e-5f
#define LEAST_VARIANCE 1e-12f

// lambda: sum_q ((lambda - Delta_q)+)^2 / v_q = 9, with v_q = sigma^2 / N_q, by Newton's method from above; weights are
// (lambda - Delta_q)+ / v_q over their sum. `scale`: factors of the differences, if has_scale.
KERNEL bound_filter(GLOBAL const float* dependent, GLOBAL const float* independent, GLOBAL const float* variances,
                    GLOBAL const float* counts, GLOBAL const float* scale, int has_scale, int width, int height,
                    int radius, GLOBAL float* colour, GLOBAL float* values) {
  const int x = get_global_id(0), y = get_global_id(1), p = y * width + x;
  if (x >= width || y >= height) return;
  float brightness = 0;
  for (int c = 0; c < 3; ++c) brightness += fabs(dependent[3 * p + c]);
  brightness = min(brightness, 1e6f);
  const float variance = max(variances[p], LEAST_VARIANCE * (brightness * brightness + LEAST_VARIANCE));
  const float factor = has_scale ? scale[p] : 1.0f, right_side = 9.0f * variance;
  const int left = max(0, x - radius), right = min(width - 1, x + radius);
  const int top = max(0, y - radius), bottom = min(height - 1, y + radius);
  // An upper bound: each pixel's term alone must not exceed the right side.
  float lambda = FAR;
  for (int v = top; v <= bottom; ++v)
    for (int u = left; u <= right; ++u) {
      const int q = v * width + u;
      const float bound = min(difference_of(dependent, p, q) * factor, FAR) + sqrt(variance) * 3 / sqrt(counts[q]);
      if (counts[q] > 0) lambda = min(lambda, bound);
    }
  for (int step = 0; step < NEWTON_STEPS; ++step) {
    float sum = 0, slope = 0;
    for (int v = top; v <= bottom; ++v)
      for (int u = left; u <= right; ++u) {
        const int q = v * width + u;
        const float excess = max(lambda - min(difference_of(dependent, p, q) * factor, FAR), 0.0f);
        const float weighted = excess * counts[q];
        slope += weighted;
        sum = fma(weighted, excess, sum);
      }
    const float excess = max(sum - right_side, 0.0f);
    if (!(excess > TOLERANCE * right_side)) break;
    lambda -= excess / (2.0f * max(slope, 1e-30f));
  }
  float sums[3] = {0, 0, 0}, partners = 0, slope = 0, sum = 0;
  for (int v = top; v <= bottom; ++v)
    for (int u = left; u <= right; ++u) {
      const int q = v * width + u;
      const float excess = max(lambda - min(difference_of(dependent, p, q) * factor, FAR), 0.0f);
#if PLANTED_BUG
      const float weighted = excess;
#else
      const float weighted = excess * counts[q];
#endif
      for (int c = 0; c < 3; ++c) sums[c] = fma(weighted, independent[3 * q + c], sums[c]);
      partners += weighted > 0 ? 1.0f : 0.0f;
      slope += weighted;
      sum = fma(weighted, excess, sum);
    }
  const int is_alone = slope <= 0;  // no pixel of the window has samples
  for (int c = 0; c < 3; ++c) colour[3 * p + c] = is_alone ? 0.0f : sums[c] / slope;
  values[4 * p] = partners;
  values[4 * p + 1] = is_alone ? 0.0f : max(lambda, 0.0f) * counts[p] / slope;
  values[4 * p + 2] = is_alone ? INFINITE : lambda;
  values[4 * p + 3] = is_alone ? 0.0f : max(counts[p], slope * slope / max(sum, 1e-30f));
}
