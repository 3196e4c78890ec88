// SPDX-License-Identifier: Apache-2.0
#include "denoising/limited_groups.h"

#include <algorithm>
#include <array>

#include "core/parallel.h"

namespace covary {
namespace {

constexpr int kHalo = kLimitWindow / 2;

float brightness(const float* rgb) { return (rgb[0] + rgb[1] + rgb[2]) / 3; }

/// The brightness of the brightest of groups first, first + 2, … at each pixel; 0 if there are none.
std::vector<float> brightest(const GroupedImage& image, const std::vector<unsigned char>& valid, int first) {
  std::vector<float> result(valid.size(), 0.0f);
  parallel_for(image.height, 16, [&](int y) {
    for (int x = 0; x < image.width; ++x) {
      const size_t pixel = static_cast<size_t>(y) * image.width + x;
      if (!valid[pixel]) continue;
      for (int t = first; t < image.groups; t += 2)
        result[pixel] = std::max(result[pixel], brightness(image.pixel(x, y) + 3 * t));
    }
  });
  return result;
}

/// The largest value in the window around each pixel.
std::vector<float> largest_around(const std::vector<float>& values, int width, int height) {
  std::vector<float> along_rows(values.size()), result(values.size());
  const auto largest = [](const float* first, ptrdiff_t step, int n) {
    float value = *first;
    for (int i = 1; i < n; ++i) value = std::max(value, first[i * step]);
    return value;
  };
  parallel_for(height, 16, [&](int y) {
    for (int x = 0; x < width; ++x) {
      const int first = std::max(0, x - kHalo), end = std::min(width, x + kHalo + 1);
      const size_t row = static_cast<size_t>(y) * width;
      along_rows[row + x] = largest(&values[row + first], 1, end - first);
    }
  });
  parallel_for(height, 16, [&](int y) {
    const int first = std::max(0, y - kHalo), end = std::min(height, y + kHalo + 1);
    for (int x = 0; x < width; ++x)
      result[static_cast<size_t>(y) * width + x] =
          largest(&along_rows[static_cast<size_t>(first) * width + x], width, end - first);
  });
  return result;
}

}  // namespace

LimitedGroups::LimitedGroups(const GroupedImage& image, const std::vector<unsigned char>& valid) : view_(image) {
  data_.assign(image.data, image.data + valid.size() * image.groups * 3);
  view_.data = data_.data();
  if (image.groups < 2) return;
  const std::array<std::vector<float>, 2> limits = {
      largest_around(brightest(image, valid, 1), image.width, image.height),
      largest_around(brightest(image, valid, 0), image.width, image.height)};
  parallel_for(image.height, 16, [&](int y) {
    for (int x = 0; x < image.width; ++x) {
      const size_t pixel = static_cast<size_t>(y) * image.width + x;
      if (!valid[pixel]) continue;
      for (int t = 0; t < image.groups; ++t) {
        float* rgb = &data_[(pixel * image.groups + t) * 3];
        const float limit = kBrighter * limits[t % 2][pixel], own = brightness(rgb);
        if (own <= limit) continue;
        for (int c = 0; c < 3; ++c) rgb[c] *= limit / own;
      }
    }
  });
}

}  // namespace covary
