// SPDX-License-Identifier: Apache-2.0
// Means over the pixels of a window that look alike in the CRN image, one item a pixel: the pilot's error of h
// (estimators/pilot.h) and the light that the CRN image lacks (estimators/missing_light.h). Writes both to records.
//
// Definitions, beside those of records (pixel_record.h): PILOT and MISSING, whether to find either.
// Compiled: GROUPS=12 WEIGHTS_DIFFER=0 CONDITION=1 SHARED=1 PILOT=1 MISSING=1
// Compiled: GROUPS=12 WEIGHTS_DIFFER=0 CONDITION=0 SHARED=1 PILOT=1 MISSING=0
#include "portable.h"
#include "groups.h"
#include "pixel_record.h"

#define RADIUS 5  // of both windows, [YM2025] Eq. (11)
#define LOG2_E 1.44269504f
// Of missing_light.cpp: significance of a difference, credible variance, tolerance of similar pixels.
#define SIGNIFICANT 9.0f
#define LEAST_SIGNIFICANT 2.0f
#define CREDIBLE 0.01f
#define ALIKE (1.0f / 16)

#if MISSING
// tau^2: from the difference of both images over the window, beyond its noise.
FUNCTION float tolerance(GLOBAL const float* guide, GLOBAL const float* other, int width, int4 window) {
  float difference = 0.0f, noise = 0.0f, number = 0.0f;
  for (int y = window.y; y <= window.w; ++y)
    for (int x = window.x; x <= window.z; ++x) {
      const float4 g = vload4(y * width + x, guide), h = vload4(y * width + x, other);
      if (g.x == FAR) continue;
      difference += (h.x - g.x) + (h.y - g.y) + (h.z - g.z);
      noise += h.w;
      number += 1.0f;
    }
  difference /= number;
  noise /= number;
  const float pixels = (float)((2 * RADIUS + 1) * (2 * RADIUS + 1));
  return ALIKE / 3 * fmax(0.0f, difference * difference - 3 * noise / pixels);
}
#endif

KERNEL similar_pixels(GLOBAL const float* RESTRICT guide, GLOBAL const float* RESTRICT other,
                      GLOBAL const float* RESTRICT own_variance, int width, int height,
                      GLOBAL float* RESTRICT records) {
  const int x0 = get_global_id(0), y0 = get_global_id(1);
  if (x0 >= width || y0 >= height) return;
  const int i = y0 * width + x0;
  const float4 g = vload4(i, guide), h = vload4(i, other);
  if (g.x == FAR) return;
  int4 window;  // its first and last column and row, inside the image
  window.x = max(x0 - RADIUS, 0), window.z = min(x0 + RADIUS, width - 1);
  window.y = max(y0 - RADIUS, 0), window.w = min(y0 + RADIUS, height - 1);
  const float own = own_variance[i];
  const float pilot_factor = -LOG2_E / fmax(own, 1e-30f);
  float weights = 0.0f, p0 = 0.0f, p1 = 0.0f, p2 = 0.0f;
#if MISSING
  const float factor = -LOG2_E / fmax(own + tolerance(guide, other, width, window), 1e-30f);
  float alike = 0.0f, m0 = 0.0f, m1 = 0.0f, m2 = 0.0f, variance = 0.0f, of_pixel = 0.0f;
#endif
  for (int y = window.y; y <= window.w; ++y)
    for (int x = window.x; x <= window.z; ++x) {
      const float4 a = vload4(y * width + x, guide), b = vload4(y * width + x, other);
      const float distance = squared_length(a.x - g.x, a.y - g.y, a.z - g.z);
#if PILOT
      const float w = exp2_of_nonpositive(distance * pilot_factor) * a.w;  // [YM2025] Eq. (11)
      weights += w;
      p0 = fma(w, b.x, p0), p1 = fma(w, b.y, p1), p2 = fma(w, b.z, p2);
#endif
#if MISSING
      const float v = exp2_of_nonpositive(distance * factor) * a.w;
      alike += v;
      m0 = fma(v, b.x - a.x, m0), m1 = fma(v, b.y - a.y, m1), m2 = fma(v, b.z - a.z, m2);
      variance = fma(v * v, b.w, variance);
      of_pixel = fma(v, b.w, of_pixel);
#endif
    }
  GLOBAL float* record = records + (size_t)i * STRIDE;
#if PILOT
  const float inverse = 1.0f / weights;  // the pixel itself has weight 1, or its count
  const float d0 = p0 * inverse - h.x, d1 = p1 * inverse - h.y, d2 = p2 * inverse - h.z;
  const float factor_of_error = (float)(GROUPS + PLANTED_BUG);
  const float error[3] = {factor_of_error * (d0 * d0), factor_of_error * (d1 * d1), factor_of_error * (d2 * d2)};
  put_penalties(error, record + ERROR_OF_H);
#endif
#if MISSING
  m0 /= alike, m1 /= alike, m2 /= alike;
  variance /= alike * alike;
  of_pixel /= alike;
  const float squares = m0 * m0 + m1 * m1 + m2 * m2;
  const float known = fmin(own / fmax(CREDIBLE * of_pixel, 1e-30f), 1.0f);
  const float noise = fmax(SIGNIFICANT * known, LEAST_SIGNIFICANT) * (own + variance);
  const float beyond = sqrt(fmax(1.0f - noise / fmax(squares, 1e-30f), 0.0f));
  const float brighter = m0 + m1 + m2 > 0.0f ? beyond : 0.0f;
  const float part = own > 0.0f ? brighter : 1.0f;
  const float missing[3] = {part * m0, part * m1, part * m2}, mean[3] = {g.x, g.y, g.z};
  for (int c = 0; c < 3; ++c) {
    record[MISSING_LIGHT + c] = missing[c];
#if CONDITION
    record[GROUP_CONTRASTS + c] = mean[c] + missing[c];
#endif
  }
#endif
}
