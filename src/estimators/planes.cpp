// SPDX-License-Identifier: Apache-2.0
#include "estimators/planes.h"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "core/parallel.h"

namespace covary {

Planes::Planes(int width, int height, int count, int border, float value)
    : width_(width), height_(height), count_(count), border_(border), stride_(width + 2 * border + lanes::kLanes) {
  data_.assign(static_cast<size_t>(count) * (height + 2 * border) * stride_ + lanes::kLanes, value);
}

std::vector<unsigned char> finite_pixels(const GroupedImage& a, const GroupedImage& b, long& n_nonfinite) {
  std::vector<unsigned char> valid(static_cast<size_t>(a.width) * a.height, 1);
  std::atomic<long> bad{0};
  parallel_for(a.height, 8, [&](int y) {
    long bad_in_row = 0;
    for (int x = 0; x < a.width; ++x) {
      // 0 * v is NaN for infinite and NaN values and zero otherwise.
      float test = 0;
      for (const GroupedImage* image : {&a, &b}) {
        const float* p = image->pixel(x, y);
        for (int i = 0; i < 3 * image->groups; ++i) test += 0.0f * p[i];
      }
      if (test != 0.0f) {
        valid[static_cast<size_t>(y) * a.width + x] = 0;
        ++bad_in_row;
      }
    }
    bad += bad_in_row;
  });
  n_nonfinite = bad;
  return valid;
}

Moments moments(const GroupedImage& image, const std::vector<unsigned char>& valid, int border, float outside,
                int first, int step) {
  Moments m{Planes(image.width, image.height, 3, border, outside),
            Planes(image.width, image.height, 3, border, kUseless)};
  const int n = (image.groups - first + step - 1) / step;
  parallel_for(image.height, 8, [&](int y) {
    float* mean[3] = {m.mean.row(0, y), m.mean.row(1, y), m.mean.row(2, y)};
    float* variance[3] = {m.variance_of_mean.row(0, y), m.variance_of_mean.row(1, y), m.variance_of_mean.row(2, y)};
    for (int x = 0; x < image.width; ++x) {
      if (!valid[static_cast<size_t>(y) * image.width + x]) continue;
      const float* p = image.pixel(x, y);
      float sum[3] = {}, squares[3] = {};
      for (int t = first; t < image.groups; t += step)
        for (int c = 0; c < 3; ++c) sum[c] += p[3 * t + c];
      for (float& s : sum) s /= static_cast<float>(n);
      for (int t = first; t < image.groups; t += step)
        for (int c = 0; c < 3; ++c) squares[c] += (p[3 * t + c] - sum[c]) * (p[3 * t + c] - sum[c]);
      for (int c = 0; c < 3; ++c) {
        mean[c][x] = sum[c];
        variance[c][x] = n > 1 ? squares[c] / (static_cast<float>(n) * static_cast<float>(n - 1)) : 0.0f;
      }
    }
  });
  return m;
}

void fill_invalid(const GroupedImage& a, const GroupedImage& b, const std::vector<unsigned char>& valid,
                  Image& result) {
  for (int y = 0; y < a.height; ++y)
    for (int x = 0; x < a.width; ++x) {
      if (valid[static_cast<size_t>(y) * a.width + x]) continue;
      for (int c = 0; c < 3; ++c) {
        double sum = 0;
        int n = 0;
        for (const GroupedImage* image : {&a, &b})
          for (int t = 0; t < image->groups; ++t) {
            const float v = image->pixel(x, y)[3 * t + c];
            if (!std::isfinite(v)) continue;
            sum += v;
            ++n;
          }
        result.pixel(x, y)[c] = n ? static_cast<float>(sum / n) : 0.0f;
      }
    }
}

std::vector<Offset> window_offsets(int window) {
  const int r = window / 2;
  std::vector<Offset> offsets;
  for (int dy = -r; dy <= r; ++dy)
    for (int dx = -r; dx <= r; ++dx) offsets.push_back({dx, dy});
  std::stable_sort(offsets.begin(), offsets.end(), [](const Offset& a, const Offset& b) {
    return a.dx * a.dx + a.dy * a.dy < b.dx * b.dx + b.dy * b.dy;
  });
  return offsets;
}

}  // namespace covary
