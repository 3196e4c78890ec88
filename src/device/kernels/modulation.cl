// SPDX-License-Identifier: Apache-2.0
// Division by the albedo, and multiplication by it again, so that filters see light without textures
// (denoising/candidates.h).
#include "portable.h"
#include "pixels.h"

#define LEAST_ALBEDO 0.02f

KERNEL demodulate(GLOBAL const float* image, GLOBAL const float* albedo, int n_values, GLOBAL float* result) {
  const int i = get_global_id(0);
  if (i < n_values) result[i] = image[i] / max(albedo[i], LEAST_ALBEDO);
}

KERNEL modulate(GLOBAL const float* image, GLOBAL const float* albedo, int n_values, int first, GLOBAL float* result) {
  const int i = get_global_id(0);
#if PLANTED_BUG
  if (i < n_values) result[first + i] = image[i] * albedo[i];
#else
  if (i < n_values) result[first + i] = image[i] * max(albedo[i], LEAST_ALBEDO);
#endif
}
