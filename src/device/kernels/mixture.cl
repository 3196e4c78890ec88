// SPDX-License-Identifier: Apache-2.0
// Mixtures of images with weights by cross-validation, denoising/mixture.h: with U_p = C_p - F, the mean over both
// halves A, B of the samples of
//
//     ||h_B - F_A - sum_p x_p U_A,p||^2 times a weight
//
// has normal equations, which are summed over cells of 4 x 4 pixels, and over similar cells around each pixel; the
// weights x minimise them, plus a prior. A part's candidates C_p are M images one after another.
//
// Options: M, number of candidates (1 to 8).
// Compiled: M=2
// Compiled: M=4
// Compiled: M=6
#include "portable.h"
#include "groups.h"
#include "pixels.h"
#include "guided_cells.h"

#define SUMS (M * (M + 1) / 2 + M + 1)  // of the normal equations: upper triangle of A, b, v
#define RIDGE 1e-3f
#define SWEEPS 24
#define COUNT_OF_VARIANCE 2

// The weights of squared errors of a half's noisy image, 1 / (G'^2 + 0.01 + 2 s^2); s: standard error.
KERNEL error_weights(GLOBAL const float* guide, GLOBAL const float* std_error, int n_pixels, GLOBAL float* counts) {
  const int i = get_global_id(0);
  if (i >= n_pixels) return;
  float variance = 0;
  for (int c = 0; c < 3; ++c) variance += square(std_error[3 * i + c]) / 3;
  counts[i] = 1 / (1 / relative_weight(guide + 3 * i) + COUNT_OF_VARIANCE * variance);
}

// Adds the normal equations of pixel i to `sums`. base_a, candidates_a: of half A; h_a: its independent image.
FUNCTION void add_pixel(GLOBAL const float* base_a, GLOBAL const float* base_b, GLOBAL const float* candidates_a,
                        GLOBAL const float* candidates_b, GLOBAL const float* h_a, GLOBAL const float* h_b,
                        GLOBAL const float* counts_a, GLOBAL const float* counts_b, float bias_share, int of_pair,
                        int n_pixels, int i, float* sums) {
  const float weight_a = counts_a[i], weight_b = counts_b[i];
  // The halves' squared error minus (1 - 1 / bias_share) variance. Of a mean, the smaller weight counts, because a
  // firefly has a small one in its own half.
  const float variance = 0.25f * (weight_a + weight_b);
  const float removed = (1 - 1 / bias_share) * (of_pair ? variance : 0.5f * min(weight_a, weight_b));
  for (int c = 0; c < 3; ++c) {
    const int k = 3 * i + c;
    const float f_a = base_a[k], f_b = base_b[k];
#if PLANTED_BUG
    const float residual_a = h_a[k] - f_a, residual_b = h_b[k] - f_b;  // judged by their own samples
#else
    const float residual_a = h_b[k] - f_a, residual_b = h_a[k] - f_b;
#endif
    float u_a[M], u_b[M];
    for (int p = 0; p < M; ++p) {
      u_a[p] = candidates_a[(size_t)p * 3 * n_pixels + k] - f_a;
      u_b[p] = candidates_b[(size_t)p * 3 * n_pixels + k] - f_b;
    }
    int plane = 0;
    for (int p = 0; p < M; ++p)
      for (int q = p; q < M; ++q, ++plane)
        sums[plane] += 0.5f * (weight_a * u_a[p] * u_a[q] + weight_b * u_b[p] * u_b[q]) -
                       removed * (u_a[p] - u_b[p]) * (u_a[q] - u_b[q]);
    for (int p = 0; p < M; ++p, ++plane)
      sums[plane] += 0.5f * (weight_a * u_a[p] * residual_a + weight_b * u_b[p] * residual_b) +
                     removed * (u_a[p] - u_b[p]) * (f_a - f_b);
    for (int p = 0; p < M; ++p) sums[plane] += variance * square(u_a[p] - u_b[p]);
  }
}

// Cells in planes: the guide's mean (FAR without valid pixels), then the sums.
KERNEL normal_cells(GLOBAL const float* guide, GLOBAL const float* base_a, GLOBAL const float* base_b,
                    GLOBAL const float* candidates_a, GLOBAL const float* candidates_b, GLOBAL const float* h_a,
                    GLOBAL const float* h_b, GLOBAL const float* counts_a, GLOBAL const float* counts_b,
                    GLOBAL const uchar* valid, float bias_share, int of_pair, int width, int height,
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
      if (!valid[i]) continue;
      for (int c = 0; c < 3; ++c) mean[c] += guide[3 * i + c];
      ++n;
      add_pixel(base_a, base_b, candidates_a, candidates_b, h_a, h_b, counts_a, counts_b, bias_share, of_pair,
                width * height, i, sums);
    }
  const size_t cell = (size_t)row * columns + column, plane = (size_t)rows * columns;
  for (int c = 0; c < 3; ++c) cells[c * plane + cell] = n > 0 ? mean[c] / (float)n : FAR;
  for (int k = 0; k < SUMS; ++k) cells[(3 + k) * plane + cell] = sums[k];
}

// The normal equations of pixels from `part` x on, `part` in number, of rows first_row, …: SUMS values a part, for the
// weights of the whole image.
KERNEL normal_parts(GLOBAL const float* base_a, GLOBAL const float* base_b, GLOBAL const float* candidates_a,
                    GLOBAL const float* candidates_b, GLOBAL const float* h_a, GLOBAL const float* h_b,
                    GLOBAL const float* counts_a, GLOBAL const float* counts_b, GLOBAL const uchar* valid,
                    float bias_share, int of_pair, int width, int height, int first_row, int n_rows, int part,
                    GLOBAL float* parts) {
  const int n_parts = (width + part - 1) / part, number = get_global_id(0), row = get_global_id(1);
  if (number >= n_parts || row >= n_rows) return;
  float sums[SUMS];
  for (int k = 0; k < SUMS; ++k) sums[k] = 0;
  for (int x = part * number; x < min(width, part * (number + 1)); ++x) {
    const int i = (first_row + row) * width + x;
    if (valid[i])
      add_pixel(base_a, base_b, candidates_a, candidates_b, h_a, h_b, counts_a, counts_b, bias_share, of_pair,
                width * height, i, sums);
  }
  for (int k = 0; k < SUMS; ++k) parts[((size_t)row * n_parts + number) * SUMS + k] = sums[k];
}

// a[p][q], 0 for the base image, number M.
FUNCTION float element(const float* a, int p, int q) { return p < M && q < M ? a[p * M + q] : 0.0f; }

// Minimises x'Ax/2 - b'x + strength v ||x - prior||^2 / (2 M) over x >= 0, sum x <= 1, by exact line search along the
// edge between each pair of images (filters/mixture_weights.h). x[M]: weight of the base image.
FUNCTION void solve_mixture(const float* sums, GLOBAL const float* prior, float strength, float* x) {
  float a[M * M], b[M], gradient[M + 1], ridge = 0;
  int plane = 0;
  for (int p = 0; p < M; ++p)
    for (int q = p; q < M; ++q, ++plane) a[p * M + q] = a[q * M + p] = sums[plane];
  for (int p = 0; p < M; ++p, ++plane) b[p] = sums[plane];
  for (int p = 0; p < M; ++p) ridge += max(a[p * M + p], 0.0f);
  ridge = (ridge * RIDGE + sums[plane] * strength) / M + 1e-30f;
  for (int p = 0; p < M; ++p) {
    a[p * M + p] += ridge;
    b[p] += ridge * prior[p];
  }
  for (int p = 0; p <= M; ++p) x[p] = 1.0f / (M + 1);
  for (int p = 0; p < M; ++p) {
    gradient[p] = -b[p];
    for (int q = 0; q < M; ++q) gradient[p] += a[p * M + q] * (1.0f / (M + 1));
  }
  gradient[M] = 0;
  for (int sweep = 0; sweep < SWEEPS; ++sweep)
    UNROLL for (int p = 0; p < M; ++p)
      UNROLL for (int q = p + 1; q <= M; ++q) {
        // Moves weight `step` from q to p; along a non-convex edge, to its better end.
        const float curvature = element(a, p, p) + element(a, q, q) - 2 * element(a, p, q);
        const float slope = gradient[q] - gradient[p];
        const float wanted = curvature > ridge ? slope / curvature : (slope > 0 ? 1.0f : -1.0f);
        const float step = min(max(wanted, -x[p]), x[q]);
        x[p] += step;
        x[q] -= step;
        UNROLL for (int k = 0; k < M; ++k) gradient[k] = fma(step, element(a, k, p) - element(a, k, q), gradient[k]);
      }
}

// The weights of each pixel's candidates, M images of one channel. `prior`: M weights.
KERNEL mixture_weights(GLOBAL const float* cells, GLOBAL const float* guide, GLOBAL const float* prior, float strength,
                       int width, int height, GLOBAL float* weights) {
  const int x = get_global_id(0), y = get_global_id(1), i = y * width + x;
  if (x >= width || y >= height) return;
  float sums[SUMS], mixture[M + 1];
  sum_alike(cells, guide, x, y, width, height, SUMS, sums);
  solve_mixture(sums, prior, strength, mixture);
  for (int p = 0; p < M; ++p) weights[(size_t)p * width * height + i] = mixture[p];
}

// F + sum_p x_p (C_p - F) at valid pixels, otherwise F.
KERNEL mix_candidates(GLOBAL const float* base, GLOBAL const float* candidates, GLOBAL const float* weights,
           GLOBAL const uchar* valid, int n_pixels, GLOBAL float* mixture) {
  const int i = get_global_id(0);
  if (i >= n_pixels) return;
  for (int c = 0; c < 3; ++c) {
    const float f = base[3 * i + c];
    float sum = f;
    for (int p = 0; p < M && valid[i]; ++p)
      sum += weights[(size_t)p * n_pixels + i] * (candidates[((size_t)p * n_pixels + i) * 3 + c] - f);
    mixture[3 * i + c] = sum;
  }
}

#define WINDOW_RADIUS 2
#define LEAST (1.0f / 30)

// How much the candidates differ from the mixture (denoising/mixture.h, disagreement): squared differences over
// G'^2 + 0.01, averaged over channels and 5 x 5 pixels, then their geometric mean.
KERNEL disagreement(GLOBAL const float* candidates, GLOBAL const float* guide, GLOBAL const float* mixture,
                    GLOBAL const uchar* valid, int width, int height, GLOBAL float* result) {
  const int x = get_global_id(0), y = get_global_id(1);
  if (x >= width || y >= height) return;
  float means[M], sum = 0, logarithm = 0;
  for (int p = 0; p < M; ++p) means[p] = 0;
  int n = 0;
  for (int v = max(0, y - WINDOW_RADIUS); v <= min(height - 1, y + WINDOW_RADIUS); ++v)
    for (int u = max(0, x - WINDOW_RADIUS); u <= min(width - 1, x + WINDOW_RADIUS); ++u) {
      const int j = v * width + u;
      if (!valid[j]) continue;
      const float weight = relative_weight(guide + 3 * j);
      for (int p = 0; p < M; ++p) {
        float squares = 0;
        for (int c = 0; c < 3; ++c)
          squares += square(candidates[((size_t)p * width * height + j) * 3 + c] - mixture[3 * j + c]);
        means[p] += squares / 3 * weight;
      }
      ++n;
    }
  for (int p = 0; p < M; ++p) {
    means[p] = n > 0 ? means[p] / (float)n : 0.0f;
    sum += means[p];
  }
  for (int p = 0; p < M; ++p) logarithm += log(max(means[p], LEAST * sum / M));
  result[y * width + x] = sum > 0 ? exp(logarithm / M) : 0.0f;
}

#define BRIGHTER_THAN_NETWORK 1.5f

FUNCTION float sum_of(GLOBAL const float* rgb) { return rgb[0] + rgb[1] + rgb[2]; }

// Limits the brightness of candidates 1, 2, … by that of the network's image, the first candidate
// (denoising/parts_mixture.cpp).
KERNEL limit_by_network(GLOBAL const float* estimate, GLOBAL const float* std_error, int width, int height,
                        GLOBAL float* candidates) {
  const int x = get_global_id(0), y = get_global_id(1), i = y * width + x;
  if (x >= width || y >= height) return;
  float around = 0;
  for (int v = max(0, y - 1); v <= min(height - 1, y + 1); ++v)
    for (int u = max(0, x - 1); u <= min(width - 1, x + 1); ++u)
      around = max(around, sum_of(candidates + 3 * (v * width + u)));
  const float limit = max(BRIGHTER_THAN_NETWORK * around, sum_of(estimate + 3 * i) - 2 * sum_of(std_error + 3 * i));
  for (int p = 1; p < M; ++p) {
    GLOBAL float* candidate = candidates + ((size_t)p * width * height + i) * 3;
    const float own = sum_of(candidate);
    if (own > limit)
      for (int c = 0; c < 3; ++c) candidate[c] *= limit / own;
  }
}
