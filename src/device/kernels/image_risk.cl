// SPDX-License-Identifier: Apache-2.0
// The squared error of the written image, risk/image_risk.h: Stein's unbiased risk estimate [Stein1981] with the
// covariance from both halves of the samples,
//
//     E (M - mu)^2 = E[ (M - h)^2 - v + 2 cov(M, h) ],   2 cov(M, h) = E[ (M_A - M_B) (h_A - h_B) ] / 2,
//
// and what tells how noisy it is. Sums over 16 pixels of a row, to which the host adds in double precision.
#include "portable.h"
#include "pixels.h"

#define PART 16
#define SAME_SURFACE 0.05f  // difference of albedos or normals, summed over channels
#define BRIGHTER 10.0f
#define DARKEST 0.1f
#define RADIUS 2
// Sums of a part.
#define ERROR 0
#define COVARIANCE 1
#define VARIANCE 2
#define NOISE 3
#define NOISE_SQUARES 4
#define SPECULAR_NOISE 5
#define LIGHT 6
#define LIGHT_OF_LARGEST 7
#define SQUARED_DEVIATIONS 8
#define FOURTH_POWERS 9
#define SPREAD 10
#define VALUES 11
#define RISK_SUMS 12

// Whether the surface behind differs from the first one.
FUNCTION int surfaces_differ(GLOBAL const float* first, GLOBAL const float* behind, int i) {
  float sum = 0;
  for (int c = 0; c < 3; ++c) sum += fabs(first[3 * i + c] - behind[3 * i + c]);
  return sum > SAME_SURFACE;
}

// The fraction of light in the largest of a pixel's groups, and the variation between groups.
FUNCTION void add_groups(GLOBAL const float* groups, int n_groups, float weight, float* sums) {
  float light = 0, largest = 0, mean[3] = {0, 0, 0};
  for (int t = 0; t < n_groups; ++t) {
    float sum = 0;
    for (int c = 0; c < 3; ++c) {
      sum += max(groups[3 * t + c], 0.0f);
      mean[c] += groups[3 * t + c];
    }
    light += sum;
    largest = max(largest, sum);
  }
  const float part = 1.0f / (float)n_groups;
  for (int c = 0; c < 3; ++c) {
    float second = 0, fourth = 0;
    for (int t = 0; t < n_groups; ++t) {
      const float d = weight * square(groups[3 * t + c] - part * mean[c]);
      second += part * d;
      fourth += part * d * d;
    }
    sums[SQUARED_DEVIATIONS] += second * second;
    sums[FOURTH_POWERS] += fourth;
  }
  sums[LIGHT] += sqrt(weight) * light;
  sums[LIGHT_OF_LARGEST] += sqrt(weight) * largest;
}

// Light that the image has from elsewhere, such as a firefly's, where the samples show none.
FUNCTION float spread_at(GLOBAL const float* image, GLOBAL const float* h, GLOBAL const float* v,
                         GLOBAL const uchar* valid, int x, int y, int width, int height) {
  const int i = y * width + x;
  const float own = grey_of(image + 3 * i);
  float around = max(DARKEST, grey_of(h + 3 * i));
  if (own <= BRIGHTER * around) return 0;
  float values[25];
  int n = 0;
  for (int w = max(0, y - RADIUS); w <= min(height - 1, y + RADIUS); ++w)
    for (int u = max(0, x - RADIUS); u <= min(width - 1, x + RADIUS); ++u)
      if (valid[w * width + u]) values[n++] = grey_of(h + 3 * (w * width + u));
  // The value that n / 2 others precede; equal ones precede each other in their order.
  for (int k = 0; k < n; ++k) {
    int before = 0;
    for (int j = 0; j < n; ++j) before += values[j] < values[k] || (values[j] == values[k] && j < k);
    if (before == n / 2) around = max(around, values[k]);
  }
  if (own <= BRIGHTER * around) return 0;
  float error = 0;
  for (int c = 0; c < 3; ++c) error += square(image[3 * i + c] - h[3 * i + c]) - v[3 * i + c];
  return error / (around * around + 0.01f);
}

// `surfaces`: 1 if normals behind the first surface are given, 2 if albedos are, 3 both.
KERNEL risk_parts(GLOBAL const float* image, GLOBAL const float* half_a, GLOBAL const float* half_b,
                  GLOBAL const float* h, GLOBAL const float* v, GLOBAL const float* h_a, GLOBAL const float* h_b,
                  GLOBAL const float* groups, int n_groups, GLOBAL const float* guide, GLOBAL const uchar* valid,
                  int surfaces, GLOBAL const float* normal, GLOBAL const float* normal_behind,
                  GLOBAL const float* albedo, GLOBAL const float* albedo_behind, int width, int height,
                  GLOBAL float* parts) {
  const int n_parts = (width + PART - 1) / PART, part = get_global_id(0), y = get_global_id(1);
  if (part >= n_parts || y >= height) return;
  float sums[RISK_SUMS];
  for (int k = 0; k < RISK_SUMS; ++k) sums[k] = 0;
  for (int x = PART * part; x < min(width, PART * (part + 1)); ++x) {
    const int i = y * width + x;
    if (!valid[i]) continue;
    const float weight = relative_weight(guide + 3 * i);
    float error = 0, covariance = 0, variance = 0, noise = 0;
    for (int c = 0; c < 3; ++c) {
      const int k = 3 * i + c;
      const float difference = half_a[k] - half_b[k], twice = 0.5f * difference * (h_a[k] - h_b[k]);
      noise += v[k];
#if PLANTED_BUG
      error += square(image[k] - h[k]) - v[k];
#else
      error += square(image[k] - h[k]) - v[k] + twice;
#endif
      covariance += twice;
      variance += 0.25f * square(difference);
    }
    sums[ERROR] += weight * error;
    sums[COVARIANCE] += weight * covariance;
    sums[VARIANCE] += weight * variance;
    sums[NOISE] += weight * noise;
    sums[NOISE_SQUARES] += square(weight * noise);
    if (((surfaces & 1) && surfaces_differ(normal, normal_behind, i)) ||
        ((surfaces & 2) && surfaces_differ(albedo, albedo_behind, i)))
      sums[SPECULAR_NOISE] += weight * noise;
    sums[VALUES] += 3;
    sums[SPREAD] += spread_at(image, h, v, valid, x, y, width, height);
    add_groups(groups + (size_t)i * n_groups * 3, n_groups, weight, sums);
  }
  for (int k = 0; k < RISK_SUMS; ++k) parts[(size_t)(y * n_parts + part) * RISK_SUMS + k] = sums[k];
}
