// SPDX-License-Identifier: Apache-2.0
// Moments of the groups of a pixel, as film/groups.h and filters/planes.h define them.

// Guide values and errors of pixels that are not used, and the limit of usable values (filters/planes.h).
#define FAR 1e18f
#define USELESS 1e30f
#define TOO_LARGE 1.1258999e15f  // 2^50

// Samples in a group, of `count` samples of the pixel.
FUNCTION float group_size(uint count, int groups, int group) {
  return (float)(count / (uint)groups + ((uint)group < count % (uint)groups ? 1u : 0u));
}

// Whether n values are all usable; NaN is not.
FUNCTION int are_usable(GLOBAL const float* values, int n) {
  int usable = 1;
  for (int i = 0; i < n; ++i) usable &= fabs(values[i]) < TOO_LARGE;
  return usable;
}

// Mean and variance of the mean, per channel, of the groups first, first + step, …: of equal sizes, or, with counts,
// m = sum n_t m_t / N and sum n_t (m_t - m)^2 / ((n - 1) N).
FUNCTION void moments_of(GLOBAL const float* p, int groups, uint count, int first, int step, float* mean,
                         float* variance) {
  const int n = (groups - first + step - 1) / step;
  const int equal = count % (uint)groups == 0u;
  float samples = equal ? (float)n : 0.0f;
  for (int c = 0; c < 3; ++c) mean[c] = variance[c] = 0.0f;
  for (int t = first; t < groups; t += step) {
    const float size = equal ? 1.0f : group_size(count, groups, t);
    if (!equal) samples += size;
    for (int c = 0; c < 3; ++c) mean[c] += size * p[3 * t + c];
  }
  for (int c = 0; c < 3; ++c) mean[c] /= samples;
  for (int t = first; t < groups; t += step) {
    const float size = equal ? 1.0f : group_size(count, groups, t);
    for (int c = 0; c < 3; ++c) variance[c] += size * (p[3 * t + c] - mean[c]) * (p[3 * t + c] - mean[c]);
  }
  for (int c = 0; c < 3; ++c) variance[c] = n > 1 ? variance[c] / (samples * (float)(n - 1)) : 0.0f;
}
