// SPDX-License-Identifier: Apache-2.0
// Layers of a picture, denoising/layers.h: means of a layer's groups, also with each group scaled as that of the picture
// is limited (group_moments.cl).
#include "portable.h"
#include "groups.h"
#include "pixels.h"

#define BRIGHTER 6  // denoising/limited_groups.h

// One item a pixel; zero where it is left out. `counts`, `valid`, limits: of the picture.
KERNEL layer_means(GLOBAL const float* layer, GLOBAL const float* picture, GLOBAL const uint* counts, int has_counts,
                   GLOBAL const uchar* valid, GLOBAL const float* limits_of_even, GLOBAL const float* limits_of_odd,
                   int is_limited,
                   int groups, int n_pixels, GLOBAL float* mean, GLOBAL float* limited) {
  const int i = get_global_id(0);
  if (i >= n_pixels) return;
  float m[3] = {0, 0, 0}, without_fireflies[3] = {0, 0, 0}, samples = 0;
  for (int t = 0; valid[i] && t < groups; ++t) {
    const size_t group = ((size_t)i * groups + t) * 3;
    const float limit = is_limited ? BRIGHTER * (t % 2 ? limits_of_odd[i] : limits_of_even[i]) : 0.0f;
    const float own = grey_of(picture + group);
    const float size = group_size(has_counts ? counts[i] : (uint)groups, groups, t);
    const float scale = is_limited && own > limit && !PLANTED_BUG ? limit / own : 1.0f;
    samples += size;
    for (int c = 0; c < 3; ++c) {
      m[c] += size * layer[group + c];
      without_fireflies[c] += size * (scale * layer[group + c]);
    }
  }
  for (int c = 0; c < 3; ++c) {
    mean[3 * (size_t)i + c] = valid[i] ? m[c] / samples : 0.0f;
    limited[3 * (size_t)i + c] = valid[i] ? without_fireflies[c] / samples : 0.0f;
  }
}
