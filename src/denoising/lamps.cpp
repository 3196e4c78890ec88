// SPDX-License-Identifier: Apache-2.0
#include "denoising/lamps.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/parallel.h"

namespace covary {
namespace {

constexpr int kReach = 2;  // pixels beside a lamp that it may cover in part

/// One value per pixel; 0 where it is not finite.
Image brightness_of(const Image& picture) {
  Image grey(picture.width, picture.height, 1);
  for (size_t i = 0; i < grey.data.size(); ++i) {
    const float sum = picture.data[3 * i] + picture.data[3 * i + 1] + picture.data[3 * i + 2];
    grey.data[i] = std::isfinite(sum) ? sum / 3 : 0;
  }
  return grey;
}

/// Of the pixels that are not black; 0 if all are.
float median_of(const Image& grey) {
  std::vector<float> values;
  for (const float value : grey.data)
    if (value > 0) values.push_back(value);
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Calls visit(x, y) for the pixels of the image at most `radius` away.
template <typename Visit>
void around(const Image& image, int x, int y, int radius, const Visit& visit) {
  for (int v = std::max(y - radius, 0); v <= std::min(y + radius, image.height - 1); ++v)
    for (int u = std::max(x - radius, 0); u <= std::min(x + radius, image.width - 1); ++u) visit(u, v);
}

/// Brightness of the pixels that are a lamp with all of their neighbours; 0 elsewhere.
Image lamps_in(const Image& grey) {
  const float least = kLampBrightness * median_of(grey);
  Image lamps(grey.width, grey.height, 1);
  parallel_for(grey.height, [&](int y) {
    for (int x = 0; x < grey.width; ++x) {
      const float here = *grey.pixel(x, y);
      bool is_even = here > least;
      if (is_even)
        around(grey, x, y, 1,
               [&](int u, int v) { is_even = is_even && std::abs(*grey.pixel(u, v) - here) <= kLampNoise * here; });
      if (is_even) *lamps.pixel(x, y) = here;
    }
  });
  return lamps;
}

}  // namespace

void darken_lamps(const Image& picture, Image& albedo) {
  if (picture.width != albedo.width || picture.height != albedo.height || picture.channels != 3) return;
  const Image grey = brightness_of(picture), lamps = lamps_in(grey);
  if (std::ranges::none_of(lamps.data, [](float lamp) { return lamp > 0; })) return;
  parallel_for(grey.height, [&](int y) {
    for (int x = 0; x < grey.width; ++x) {
      float lamp = 0, beside = 0;
      around(lamps, x, y, kReach, [&](int u, int v) {
        const float value = *lamps.pixel(u, v);
        beside = std::max(beside, value);
        if (std::max(std::abs(u - x), std::abs(v - y)) <= 1) lamp = std::max(lamp, value);
      });
      if (beside <= 0) continue;
      const float left = lamp > 0 ? 0 : 1 - std::clamp(*grey.pixel(x, y) / beside, 0.0f, 1.0f);
      for (int c = 0; c < 3; ++c) albedo.pixel(x, y)[c] *= left;
    }
  });
}

}  // namespace covary
