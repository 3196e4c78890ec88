// SPDX-License-Identifier: Apache-2.0
#include "live/coarse.h"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "core/parallel.h"
#include "estimators/mean.h"

namespace covary {
namespace {

constexpr int kRows = 16;  // that a thread takes at a time

/// Means over squares of `n` values per pixel, of which each pixel has `step`.
std::vector<float> means_over_squares(const float* data, int width, int height, int step, int n, int stride) {
  const int w = (width + stride - 1) / stride, h = (height + stride - 1) / stride;
  std::vector<float> means(static_cast<size_t>(w) * h * n);
  parallel_for(h, [&](int y) {
    const int end_y = std::min((y + 1) * stride, height);
    for (int x = 0; x < w; ++x) {
      float* sum = &means[(static_cast<size_t>(y) * w + x) * n];
      const int end_x = std::min((x + 1) * stride, width);
      for (int j = y * stride; j < end_y; ++j)
        for (int i = x * stride; i < end_x; ++i) {
          const float* pixel = data + (static_cast<size_t>(j) * width + i) * step;
          for (int k = 0; k < n; ++k) sum[k] += pixel[k];
        }
      const auto area = static_cast<float>((end_y - y * stride) * (end_x - x * stride));
      for (int k = 0; k < n; ++k) sum[k] /= area;
    }
  });
  return means;
}

}  // namespace

Image coarse_image(const Image& image, int stride) {
  if (stride == 1) return image;
  Image coarse((image.width + stride - 1) / stride, (image.height + stride - 1) / stride, image.channels);
  coarse.data =
      means_over_squares(image.data.data(), image.width, image.height, image.channels, image.channels, stride);
  return coarse;
}

CoarseGroups coarse_groups(const Film& film, int stride, int groups) {
  CoarseGroups coarse;
  coarse.data =
      means_over_squares(film.data().data(), film.width(), film.height(), 3 * film.groups(), 3 * groups, stride);
  coarse.image.width = (film.width() + stride - 1) / stride;
  coarse.image.height = (film.height() + stride - 1) / stride;
  coarse.image.groups = groups;
  coarse.image.data = coarse.data.data();
  return coarse;
}

MeanAndError mean_of_films(const std::vector<const Film*>& films, const Film* light) {
  const int width = films[0]->width(), height = films[0]->height();
  MeanAndError all{Image(width, height, 3), Image(width, height, 3)};
  std::atomic<bool> has_error{true};
  parallel_for((height + kRows - 1) / kRows, [&](int band) {
    const int first = band * kRows, n_rows = std::min(kRows, height - first);
    std::vector<EstimatorResult> means;
    for (const Film* film : films) means.push_back(mean_of_groups(rows_of(*film, first, n_rows)));
    for (int y = 0; y < n_rows; ++y)
      for (int x = 0; x < width; ++x) {
        double samples = 0;
        for (const Film* film : films) samples += film->count(x, first + y);
        for (int c = 0; c < 3; ++c) {
          double mean = 0, variance = 0;
          for (size_t f = 0; f < films.size(); ++f) {
            const double part = samples > 0 ? films[f]->count(x, first + y) / samples : 0;
            mean += part * means[f].estimate.pixel(x, y)[c];
            const Image& error = means[f].std_error;
            const double own = error.data.empty() ? INFINITY : error.pixel(x, y)[c];
            if (part > 0 || samples == 0) variance += part * part * own * own;
          }
          if (light) mean += light->mean(x, first + y)[c];
          all.mean.pixel(x, first + y)[c] = static_cast<float>(mean);
          all.std_error.pixel(x, first + y)[c] = static_cast<float>(std::sqrt(variance));
          if (!std::isfinite(variance) || samples < 2) has_error.store(false, std::memory_order_relaxed);
        }
      }
  });
  if (!has_error) all.std_error = {};
  return all;
}

}  // namespace covary
