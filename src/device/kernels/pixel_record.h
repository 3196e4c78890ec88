// SPDX-License-Identifier: Apache-2.0
// What a pixel contributes to the regressions of its neighbours: estimators/pixel_records.h. STRIDE floats a pixel, one
// record after another, so that a work group reads a neighbour's at once.
//
// Definitions: GROUPS of the CRN image, WEIGHTS_DIFFER (between pixels), CONDITION (a row for the mean constraint),
// SHARED (coefficients of the channels).
#define ROWS (WEIGHTS_DIFFER ? GROUPS : GROUPS - 1)
#define PENALTIES (SHARED ? 1 : 3)
#define GROUP_CONTRASTS (3 * ROWS)
#define CONTRASTS (GROUP_CONTRASTS + (CONDITION ? 3 : 0))
#define DIFFERENCE CONTRASTS
#define H_VARIANCE (CONTRASTS + 3)
#define MISSING_LIGHT (CONTRASTS + 6)
#define ERROR_OF_H (CONTRASTS + 9)
#define GROUP_VARIANCE (ERROR_OF_H + PENALTIES)
#define SIZE (GROUP_VARIANCE + PENALTIES)
#define STRIDE ((SIZE + 7) / 8 * 8)

// Stores the three channels of a penalty, or their sum.
FUNCTION void put_penalties(const float* values, GLOBAL float* to) {
#if SHARED
  to[0] = values[0] + values[1] + values[2];
#else
  for (int c = 0; c < 3; ++c) to[c] = values[c];
#endif
}
