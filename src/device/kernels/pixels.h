// SPDX-License-Identifier: Apache-2.0
// What the kernels of filters and mixtures share. Images have three channels, interleaved, rows from top to bottom.

#define LOG2E 1.44269504f

FUNCTION int clamped(int i, int size) { return min(max(i, 0), size - 1); }

FUNCTION float square(float x) { return x * x; }

// e^x for x <= 0.
FUNCTION float exp_of_nonpositive(float x) { return exp2_of_nonpositive(x * LOG2E); }

FUNCTION float grey_of(GLOBAL const float* rgb) { return (rgb[0] + rgb[1] + rgb[2]) / 3; }

// 1 / (F'^2 + 0.01), the weight of relMSE (risk/relative_weight.h).
FUNCTION float relative_weight(GLOBAL const float* rgb) { return 1 / (square(grey_of(rgb)) + 0.01f); }

// The weight of a place whose guide differs by d from that of the target (filters/window_sums.h),
// exp(-||d||^2 / h^2), h^2 = squared_bandwidth.
FUNCTION float alike(float d0, float d1, float d2, float squared_bandwidth) {
  return exp_of_nonpositive(-squared_length(d0, d1, d2) / max(squared_bandwidth, 1e-30f));
}
