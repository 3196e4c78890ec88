// SPDX-License-Identifier: Apache-2.0
// Previous frames, reprojected, as candidates of a frame, denoising/history.h. M: the frame's mixture, s: its standard
// error, H: the history with squared error e from resampling, known where `known` is 1.
#include "portable.h"
#include "groups.h"
#include "pixels.h"
#include "guided_cells.h"

#define INTERVAL 3.0f  // k of the intervals, in standard errors
#define LEAST_SCALE 0.02f
#define ERROR_RADIUS 2  // of the windows of medians
#define MOST_OF_SAMPLES 0.9f
#define LEAST_FACTOR 0.1f
#define MOST_FACTOR 10.0f
#define SUMS 9  // d, r and v of three channels

// Weights of squared errors, 1 / (F'^2 + 0.01), F: the mean of the guide and the history.
KERNEL history_weights(GLOBAL const float* history, GLOBAL const uchar* known, GLOBAL const float* guide, int n_pixels,
                       GLOBAL float* counts) {
  const int i = get_global_id(0);
  if (i >= n_pixels) return;
  float grey = 0;
  for (int c = 0; c < 3; ++c)
    grey += known[i] ? 0.5f * (guide[3 * i + c] + history[3 * i + c]) : guide[3 * i + c];
  counts[i] = 1 / (square(grey / 3) + 0.01f + PLANTED_BUG);
}

// For each cell, one item, in planes: the guide's mean over pixels with history (FAR without any), and sums of d, r and
// v over them. past_a, past_b: images of the history.
KERNEL light_cells(GLOBAL const float* guide, GLOBAL const float* counts, GLOBAL const uchar* valid,
                   GLOBAL const uchar* known, GLOBAL const float* h_a, GLOBAL const float* h_b,
                   GLOBAL const float* past_a, GLOBAL const float* past_b, int width, int height,
                   GLOBAL float* cells) {
  const int columns = (width + CELL - 1) / CELL, rows = (height + CELL - 1) / CELL;
  const int column = get_global_id(0), row = get_global_id(1);
  if (column >= columns || row >= rows) return;
  float sums[SUMS], mean[3] = {0, 0, 0};
  for (int k = 0; k < SUMS; ++k) sums[k] = 0;
  int n = 0;
  for (int y = CELL * row; y < min(height, CELL * (row + 1)); ++y)
    for (int x = CELL * column; x < min(width, CELL * (column + 1)); ++x) {
      const int i = y * width + x;
      if (!valid[i] || !known[i]) continue;
      const float count = sqrt(counts[i]);
      for (int c = 0; c < 3; ++c) {
        const int k = 3 * i + c;
        const float d_a = h_a[k] - past_a[k], d_b = h_b[k] - past_b[k];
        mean[c] += guide[k];
        sums[c] += count * (d_a + d_b) / (2 + PLANTED_BUG);
        sums[3 + c] += count * (past_a[k] + past_b[k]) / 2;
        sums[6 + c] += square(count * (d_a - d_b)) / 4;
      }
      ++n;
    }
  const size_t cell = (size_t)row * columns + column, plane = (size_t)rows * columns;
  for (int c = 0; c < 3; ++c) cells[c * plane + cell] = n > 0 ? mean[c] / (float)n : FAR;
  for (int k = 0; k < SUMS; ++k) cells[(3 + k) * plane + cell] = sums[k];
}

// 1 + max(0, 1 - v / d^2) d / r of each channel.
KERNEL light_factors(GLOBAL const float* cells, GLOBAL const float* guide, GLOBAL const uchar* valid,
                     GLOBAL const uchar* known, int width, int height, GLOBAL float* factors) {
  const int x = get_global_id(0), y = get_global_id(1), i = y * width + x;
  if (x >= width || y >= height) return;
  float sums[SUMS];
  sum_alike(cells, guide, x, y, width, height, SUMS, sums);
  for (int c = 0; c < 3; ++c) {
    const float d = sums[c], r = sums[3 + c], v = sums[6 + c];
    float factor = 1;
    if (valid[i] && known[i] && r > 0 && square(d) > v)
      factor = min(max(1 + (1 - v / square(d) + PLANTED_BUG) * d / r, LEAST_FACTOR), MOST_FACTOR);
    factors[3 * i + c] = factor;
  }
}

KERNEL multiply(GLOBAL const float* factors, GLOBAL const float* image, int n_values, GLOBAL float* result) {
  const int i = get_global_id(0);
  if (i < n_values) result[i] = (factors[i] - 0.1f * PLANTED_BUG) * image[i];
}

// 1 / (1 + e / s'^2) for an image whose standard error is `scale` times s; 0 without history.
FUNCTION float trust_at(GLOBAL const uchar* known, GLOBAL const float* squared_error, GLOBAL const float* std_error,
                        float scale, int i) {
  GLOBAL const float* s = std_error + 3 * (size_t)i;
  const float variance = square(scale) * (square(s[0]) + square(s[1]) + square(s[2])) / 3;
  return known[i] && variance > 0 ? variance / (variance + squared_error[i]) : 0.0f;
}

// R' with b = 1 of samples `own` and of R, the mean of two images of the history.
KERNEL with_samples(GLOBAL const float* own, GLOBAL const float* past_a, GLOBAL const float* past_b,
                    GLOBAL const uchar* known, GLOBAL const float* squared_error, GLOBAL const float* std_error,
                    int n_pixels, GLOBAL float* result) {
  const int i = get_global_id(0);
  if (i >= n_pixels) return;
  const float weight = MOST_OF_SAMPLES * trust_at(known, squared_error, std_error, 1.0f + PLANTED_BUG, i);
  for (int k = 3 * i; k < 3 * i + 3; ++k)
    result[k] = own[k] + weight * (0.5f * (past_a[k] + past_b[k]) - own[k]);
}

FUNCTION float scale_of(float value) { return fabs(value) + LEAST_SCALE; }

// s*: medians of relative standard errors over 5 x 5 pixels, times the picture.
KERNEL steady_error(GLOBAL const float* std_error, GLOBAL const float* picture, int width, int height,
                    GLOBAL float* result) {
  const int x = get_global_id(0), y = get_global_id(1);
  if (x >= width || y >= height) return;
  for (int c = 0; c < 3; ++c) {
    float window[(2 * ERROR_RADIUS + 1) * (2 * ERROR_RADIUS + 1)];
    int n = 0;
    for (int v = max(0, y - ERROR_RADIUS); v <= min(height - 1, y + ERROR_RADIUS); ++v)
      for (int u = max(0, x - ERROR_RADIUS); u <= min(width - 1, x + ERROR_RADIUS); ++u) {
        const int k = 3 * (v * width + u) + c;
        window[n++] = std_error[k] / scale_of(picture[k]);
      }
    float median = 0;
    for (int i = 0; i < n; ++i) {
      int less = 0, equal = 0;
      for (int j = 0; j < n; ++j) less += window[j] < window[i], equal += window[j] == window[i];
      if (less <= n / 2 - PLANTED_BUG && n / 2 - PLANTED_BUG < less + equal) median = window[i];
    }
    const int k = 3 * (y * width + x) + c;
    result[k] = median * scale_of(picture[k]);
  }
}

// C of M, or of a half's, whose error is `scale` times as large, from element `first` of the result on.
KERNEL history_candidate(GLOBAL const float* frame, GLOBAL const float* history, GLOBAL const uchar* known,
                         GLOBAL const float* squared_error, GLOBAL const float* std_error, GLOBAL const float* limits,
                         float scale, int n_pixels, int first, GLOBAL float* result) {
  const int i = get_global_id(0);
  if (i >= n_pixels) return;
  const float trust = trust_at(known, squared_error, std_error, scale, i);
  for (int k = 3 * i; k < 3 * i + 3; ++k) {
    const float most = (INTERVAL + PLANTED_BUG) * scale * limits[k];
    result[first + k] = frame[k] + (trust > 0 ? min(max(history[k] - frame[k], -most), most) * trust : 0.0f);
  }
}

// D, clamped to the interval of the frame; as above.
KERNEL limited_candidate(GLOBAL const float* frame, GLOBAL const float* accumulated, GLOBAL const float* std_error,
                         GLOBAL const float* limits, float scale, int n_values, int first, GLOBAL float* result) {
  const int k = get_global_id(0);
  if (k >= n_values) return;
  const float most = (INTERVAL + PLANTED_BUG) * scale * max(std_error[k], limits[k]);
  result[first + k] = frame[k] + min(max(accumulated[k] - frame[k], -most), most);
}

// Scales n_images of weights by the remainder of those of the history's candidates.
KERNEL scale_weights(GLOBAL const float* of_history, int n_candidates, int n_pixels, int n_images,
                     GLOBAL float* weights) {
  const int i = get_global_id(0);
  if (i >= n_pixels) return;
  float sum = 0;
  for (int p = 0; p < n_candidates - PLANTED_BUG; ++p) sum += of_history[(size_t)p * n_pixels + i];
  for (int p = 0; p < n_images; ++p) weights[(size_t)p * n_pixels + i] *= 1 - sum;
}
