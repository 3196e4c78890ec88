// SPDX-License-Identifier: Apache-2.0
// Grouped images: pixels that can be used, limits of fireflies, moments. A set of groups is first, first + step, … of
// all groups T: all samples (0, 1), or a half (0, 2 or 1, 2). Group means are as in film/grouped_image.h.
#include "portable.h"
#include "groups.h"
#include "pixels.h"

#define LIMIT_RADIUS 3  // denoising/limited_groups.h
#define BRIGHTER 6

// Values whose groups, rows, pixels and channels lie so many floats apart, in the order of film/grouped_image.h.
KERNEL in_order(GLOBAL const float* from, long of_groups, long of_rows, long of_pixels, long of_channels, int groups,
                int width, int n_pixels, GLOBAL float* values) {
  const int i = get_global_id(0);
  if (i >= n_pixels) return;
  GLOBAL const float* const pixel = from + i / width * of_rows + i % width * of_pixels;
  for (int t = 0; t < groups; ++t)
    for (int c = 0; c < 3; ++c)
      values[((size_t)i * groups + t) * 3 + c] = pixel[t * of_groups + (c + PLANTED_BUG) % 3 * of_channels];
}

// 1 for pixels whose values are all usable.
KERNEL usable_pixels(GLOBAL const float* data, int groups, int n_pixels, GLOBAL uchar* valid) {
  const int i = get_global_id(0);
  if (i >= n_pixels) return;
  valid[i] = (uchar)are_usable(data + (size_t)i * groups * 3, 3 * groups);
}

// The brightness of the brightest of groups 1, 3, … of the set, and of groups 0, 2, …, which limit each other.
KERNEL brightest_groups(GLOBAL const float* data, GLOBAL const uchar* valid, int groups, int first, int step,
                             int n_pixels, GLOBAL float* odd, GLOBAL float* even) {
  const int i = get_global_id(0);
  if (i >= n_pixels) return;
  float brightest[2] = {0, 0};
  if (valid[i])
    for (int t = first, parity = 0; t < groups; t += step, parity ^= 1)
      brightest[parity] = max(brightest[parity], grey_of(data + ((size_t)i * groups + t) * 3));
  even[i] = brightest[0];
  odd[i] = brightest[1];
}

// The largest of the seven values around a pixel along a row (stride 1) or a column (stride width).
KERNEL largest_along(GLOBAL const float* values, int width, int height, int along_column, GLOBAL float* largest) {
  const int x = get_global_id(0), y = get_global_id(1);
  if (x >= width || y >= height) return;
  const int place = along_column ? y : x, size = along_column ? height : width, stride = along_column ? width : 1;
  const int i = y * width + x;
  float value = values[i];
  for (int o = max(-LIMIT_RADIUS, -place); o <= min(LIMIT_RADIUS, size - 1 - place); ++o)
    value = max(value, values[i + o * stride]);
  largest[i] = value;
}

// Mean of a set of groups, weighted by their sizes n_t, and its variance: sum n_t (m_t - m)^2 / ((n - 1) N). With
// `is_limited`, groups brighter than BRIGHTER times the limit of their parity are scaled down first.
KERNEL group_moments(GLOBAL const float* data, GLOBAL const uint* counts, int has_counts,
                          GLOBAL const uchar* valid, GLOBAL const float* limits_of_even,
                          GLOBAL const float* limits_of_odd, int is_limited, int groups, int first, int step,
                          int n_pixels, GLOBAL float* mean, GLOBAL float* variance_of_mean) {
  const int i = get_global_id(0);
  if (i >= n_pixels) return;
  float m[3] = {0, 0, 0}, squares[3] = {0, 0, 0}, samples = 0;
  int n = 0;
  if (valid[i]) {
    const uint count = has_counts ? counts[i] : (uint)groups;
    const float limits[2] = {BRIGHTER * (is_limited ? limits_of_even[i] : 0.0f),
                             BRIGHTER * (is_limited ? limits_of_odd[i] : 0.0f)};
    for (int pass = 0; pass < 2; ++pass) {
      for (int t = first, parity = 0; t < groups; t += step, parity ^= 1) {
        GLOBAL const float* rgb = data + ((size_t)i * groups + t) * 3;
        const float size = group_size(count, groups, t), own = grey_of(rgb);
#if PLANTED_BUG
        const float scale = 1;
#else
        const float scale = is_limited && own > limits[parity] ? limits[parity] / own : 1.0f;
#endif
        for (int c = 0; c < 3; ++c) {
          const float value = scale * rgb[c];
          if (pass == 0)
            m[c] += size * value;
          else
            squares[c] += size * square(value - m[c]);
        }
        if (pass == 0) samples += size, ++n;
      }
      if (pass == 0)
        for (int c = 0; c < 3; ++c) m[c] /= samples;
    }
  }
  for (int c = 0; c < 3; ++c) {
    mean[3 * i + c] = m[c];
    variance_of_mean[3 * i + c] = !valid[i] ? USELESS : n > 1 ? squares[c] / (samples * (float)(n - 1)) : 0.0f;
  }
}

// Sets pixels that are left out to the mean of their usable groups, or else of the valid pixels of the surrounding
// 5 x 5, or zero (filters/planes.h, fill_invalid).
KERNEL fill_invalid(GLOBAL const float* data, GLOBAL const uchar* valid, int groups, int width, int height,
                         GLOBAL float* image) {
  const int x = get_global_id(0), y = get_global_id(1), i = y * width + x;
  if (x >= width || y >= height || valid[i]) return;
  for (int c = 0; c < 3; ++c) {
    float sum = 0;
    int n = 0;
    for (int t = 0; t < groups; ++t) {
      const float value = data[((size_t)i * groups + t) * 3 + c];
      if (fabs(value) < TOO_LARGE) sum += value, ++n;
    }
    if (n == 0)
      for (int v = max(0, y - 2); v <= min(height - 1, y + 2); ++v)
        for (int u = max(0, x - 2); u <= min(width - 1, x + 2); ++u)
          if (valid[v * width + u]) sum += image[3 * (v * width + u) + c], ++n;
    image[3 * i + c] = n > 0 ? sum / (float)n : 0.0f;
  }
}

#define WINDOW_RADIUS 2
#define PRIOR_FREEDOM 8.0f

// Root of `scale` times the variance, which has `freedom` degrees of freedom, shrunk towards that of the surrounding
// pixels: their power mean with an exponent of 3/4 (denoising/denoising_parts.cpp).
KERNEL standard_error(GLOBAL const float* variance, GLOBAL const uchar* valid, int width, int height,
                           float freedom, float scale, GLOBAL float* std_error) {
  const int x = get_global_id(0), y = get_global_id(1), i = y * width + x;
  if (x >= width || y >= height) return;
  float sums[3] = {0, 0, 0};
  int n = 0;
  for (int v = max(0, y - WINDOW_RADIUS); v <= min(height - 1, y + WINDOW_RADIUS); ++v)
    for (int u = max(0, x - WINDOW_RADIUS); u <= min(width - 1, x + WINDOW_RADIUS); ++u) {
      const int j = v * width + u;
      if (!valid[j]) continue;
      for (int c = 0; c < 3; ++c) sums[c] += sqrt(variance[3 * j + c]) * sqrt(sqrt(variance[3 * j + c]));
      ++n;
    }
  const float own = freedom / (freedom + PRIOR_FREEDOM);
  for (int c = 0; c < 3; ++c) {
    const float lessened = n > 0 ? sums[c] / (float)n : 0.0f, around = lessened * cbrt(lessened);
    std_error[3 * i + c] = valid[i] ? sqrt(scale * (own * variance[3 * i + c] + (1 - own) * around)) : 0.0f;
  }
}

// out = factor * image, for all values.
KERNEL scaled(GLOBAL const float* image, float factor, int n_values, GLOBAL float* result) {
  const int i = get_global_id(0);
  if (i < n_values) result[i] = factor * image[i];
}
