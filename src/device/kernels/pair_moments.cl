// SPDX-License-Identifier: Apache-2.0
// A pair of grouped images, one item a pixel: which pixels are usable, the moments of their groups (filters/planes.h),
// and their records (pixel_record.h) as far as they do not depend on other pixels.
//
// Definitions, beside those of records: INDEPENDENT_GROUPS, CRN_COUNTS and INDEPENDENT_COUNTS (whether there are counts
// of samples), RELATIVE (whether those of independent pixels differ), HAS_ERROR (of h: its variance, until similar_pixels.cl replaces it).
// Compiled: GROUPS=12 INDEPENDENT_GROUPS=12 CRN_COUNTS=0 INDEPENDENT_COUNTS=0 RELATIVE=0 WEIGHTS_DIFFER=0 CONDITION=1 SHARED=1 HAS_ERROR=1
// Compiled: GROUPS=12 INDEPENDENT_GROUPS=8 CRN_COUNTS=1 INDEPENDENT_COUNTS=1 RELATIVE=1 WEIGHTS_DIFFER=1 CONDITION=0 SHARED=0 HAS_ERROR=0
#include "portable.h"
#include "groups.h"
#include "pixel_record.h"

#if WEIGHTS_DIFFER
// sqrt(w_t) (x_t - mean), w_t = size T / count.
FUNCTION void put_contrasts(GLOBAL const float* p, uint count, const float* mean, GLOBAL float* record,
                            float* squares) {
  for (int t = 0; t < GROUPS; ++t) {
    const float weight = sqrt((float)GROUPS * group_size(count, GROUPS, t) / (float)count);
    for (int c = 0; c < 3; ++c) {
      const float value = weight * (p[3 * t + c] - mean[c]);
      squares[c] += value * value;
      record[3 * t + c] = value;
    }
  }
}
#else
// Contrast j: (x_0 + … + x_{j-1} - j x_j) / sqrt(j (j + 1)); for groups of unequal sizes, with w_t = size T / count and
// W = w_0 + … + w_{j-1}, ((w_0 x_0 + … + w_{j-1} x_{j-1}) / W - x_j) sqrt(w_j W / (W + w_j)).
FUNCTION void put_contrasts(GLOBAL const float* p, uint count, const float* mean, GLOBAL float* record,
                            float* squares) {
  const int equal = count % (uint)GROUPS == 0u;
  const float unit = (float)GROUPS / (float)count;
  float total = equal ? 1.0f : unit * group_size(count, GROUPS, 0);
  float sum[3];
  for (int c = 0; c < 3; ++c) sum[c] = total * p[c];
  for (int j = 1; j < GROUPS; ++j) {
    const float w = equal ? 1.0f : unit * group_size(count, GROUPS, j);
    const float factor = equal ? 1.0f / sqrt((float)j * (float)(j + 1)) : sqrt(w * total / (total + w));
    for (int c = 0; c < 3; ++c) {
      const float value = p[3 * j + c];
      const float contrast = (equal ? sum[c] - (float)j * value : sum[c] / total - value) * factor;
      sum[c] += w * value;
      squares[c] += contrast * contrast;
      record[3 * (j - 1) + c] = contrast;
    }
    total += w;
  }
}
#endif

// `relative`: samples of each independent pixel, relative to the image's mean; read if RELATIVE.
// Results: `guide`, g and that relative number (FAR where not usable); `other`, h and its variance summed over RGB;
// `own`, the variance of g summed over RGB; `valid`; `records`.
KERNEL pair_moments(GLOBAL const float* RESTRICT crn, GLOBAL const float* RESTRICT independent,
                    GLOBAL const uint* RESTRICT crn_counts, GLOBAL const uint* RESTRICT independent_counts,
                    GLOBAL const float* RESTRICT relative, int n, GLOBAL uchar* RESTRICT valid,
                    GLOBAL float* RESTRICT guide, GLOBAL float* RESTRICT other, GLOBAL float* RESTRICT own,
                    GLOBAL float* RESTRICT records) {
  const int i = get_global_id(0);
  if (i >= n) return;
  GLOBAL const float* p = crn + (size_t)i * (3 * GROUPS);
  GLOBAL const float* q = independent + (size_t)i * (3 * INDEPENDENT_GROUPS);
  GLOBAL float* record = records + (size_t)i * STRIDE;
  const float useless[3] = {USELESS, USELESS, USELESS};
  const int usable = are_usable(p, 3 * GROUPS) & are_usable(q, 3 * INDEPENDENT_GROUPS);
  valid[i] = usable;
  if (!usable) {
    vstore4(FLOAT4(FAR, FAR, FAR, 1.0f), i, guide);
    vstore4(FLOAT4(0.0f, 0.0f, 0.0f, 0.0f), i, other);
    own[i] = 0.0f;
    for (int e = 0; e < SIZE; ++e) record[e] = 0.0f;
    put_penalties(useless, record + ERROR_OF_H);
    return;
  }
  const uint crn_count = CRN_COUNTS ? crn_counts[i] : GROUPS;
  const uint independent_count = INDEPENDENT_COUNTS ? independent_counts[i] : INDEPENDENT_GROUPS;
  float g[3], g_variance[3], h[3], h_variance[3], squares[3] = {0.0f, 0.0f, 0.0f}, error[3], group_variance[3];
  moments_of(p, GROUPS, crn_count, 0, 1, g, g_variance);
  moments_of(q, INDEPENDENT_GROUPS, independent_count, 0, 1, h, h_variance);
  put_contrasts(p, crn_count, g, record, squares);
  for (int c = 0; c < 3; ++c) {
    record[DIFFERENCE + c] = g[c] - h[c];
    record[H_VARIANCE + c] = h_variance[c];
    record[MISSING_LIGHT + c] = 0.0f;
    error[c] = HAS_ERROR ? (float)GROUPS * h_variance[c] : 0.0f;
    group_variance[c] = squares[c] / (float)(GROUPS - 1 + PLANTED_BUG);
#if CONDITION
    record[GROUP_CONTRASTS + c] = g[c];
#endif
  }
  put_penalties(error, record + ERROR_OF_H);
  put_penalties(group_variance, record + GROUP_VARIANCE);
  vstore4(FLOAT4(g[0], g[1], g[2], RELATIVE ? relative[i] : 1.0f), i, guide);
  vstore4(FLOAT4(h[0], h[1], h[2], h_variance[0] + h_variance[1] + h_variance[2]), i, other);
  own[i] = g_variance[0] + g_variance[1] + g_variance[2];
}
