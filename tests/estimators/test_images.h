// SPDX-License-Identifier: Apache-2.0
// Synthetic grouped images for tests: a smooth picture with an edge, and noise that is shared by all pixels (CRN) up to
// a fraction of their own, or independent, with rare bright outliers.
#pragma once

#include <cmath>
#include <vector>

#include "core/random.h"
#include "film/grouped_image.h"

namespace covary::test {

struct Grouped {
  int width, height, groups;
  std::vector<float> data;
  std::vector<uint32_t> counts = {};  // empty: equal for all pixels
  GroupedImage view() const { return {width, height, groups, data.data(), counts.empty() ? nullptr : counts.data()}; }
  float* pixel(int x, int y) { return data.data() + (static_cast<size_t>(y) * width + x) * groups * 3; }
};

inline Grouped constant_image(int width, int height, int groups, float value) {
  return {width, height, groups, std::vector<float>(static_cast<size_t>(width) * height * groups * 3, value)};
}

/// Expected value of the picture, without outliers.
inline double expected(int x, int y, int c) {
  const double smooth = 1.0 + 0.5 * std::sin(0.21 * x + c) * std::cos(0.17 * y);
  return (x + y > 45 ? 0.3 : 1.0) * smooth * (1.0 + 0.2 * c);
}

/// Hash noise, uniform in [-1/2, 1/2).
inline float noise(uint64_t seed, uint64_t a, uint64_t b) {
  return static_cast<float>(mix64(combine64(combine64(seed, a), b)) >> 40) * 0x1p-24f - 0.5f;
}

/// `own`: fraction of the noise that pixels do not share; 1 makes an independent image. Outliers, of relative frequency
/// `outliers` times `own`, add five times the expected value.
inline Grouped noisy_image(int width, int height, int groups, uint64_t seed, float own, float outliers = 0.01f) {
  Grouped image = constant_image(width, height, groups, 0);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      for (int i = 0; i < groups * 3; ++i) {
        const uint64_t pixel = 1 + static_cast<uint64_t>(y) * width + x;
        const float common = noise(seed, 0, i), alone = noise(seed, pixel, i);
        const bool bright = noise(seed + 77, pixel, i / 3) + 0.5f < outliers * own;
        const float relative = 1.0f + (1.0f - own) * common + own * alone + (bright ? 5.0f : 0.0f);
        image.pixel(x, y)[i] = static_cast<float>(expected(x, y, i % 3)) * relative;
      }
  return image;
}

inline Grouped crn_image(int width, int height, int groups, uint64_t seed) {
  return noisy_image(width, height, groups, seed, 0.2f);
}
inline Grouped independent_image(int width, int height, int groups, uint64_t seed) {
  return noisy_image(width, height, groups, seed + 1000, 1.0f);
}

}  // namespace covary::test
