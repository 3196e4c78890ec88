// SPDX-License-Identifier: Apache-2.0
#include "filters/filter_input.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "film/groups.h"

namespace covary {
namespace {

/// Mean of all samples of a pixel.
Spectrum mean_of(const GroupedImage& image, int x, int y) {
  const float* groups = image.pixel(x, y);
  const uint32_t count = image.count(x, y);
  double sum[3] = {};
  for (int t = 0; t < image.groups; ++t)
    for (int c = 0; c < 3; ++c) sum[c] += static_cast<double>(group_size(count, image.groups, t)) * groups[3 * t + c];
  const double scale = count > 0 ? 1.0 / count : 0;
  return {static_cast<float>(sum[0] * scale), static_cast<float>(sum[1] * scale), static_cast<float>(sum[2] * scale)};
}

/// Variance of one sample as a scalar, sum |C_s - C|^2 / (n - 1): exact for kEuclidean; for kSum (sum of the channels'
/// standard deviations)^2, an upper bound, exact if channels vary proportionally.
float scalar_variance(const Spectrum& variance, Norm norm) {
  if (norm == Norm::kEuclidean) return variance.r + variance.g + variance.b;
  const float sum = std::sqrt(variance.r) + std::sqrt(variance.g) + std::sqrt(variance.b);
  return sum * sum;
}

float pooled_variance(const GroupedImage& a, const GroupedImage& b, int x, int y, Norm norm) {
  const double of_a = variance_freedom(a, x, y), of_b = variance_freedom(b, x, y);
  if (of_a + of_b <= 0) return 0;
  const double sum =
      of_a * scalar_variance(a.sample_variance(x, y), norm) + of_b * scalar_variance(b.sample_variance(x, y), norm);
  return static_cast<float>(sum / (of_a + of_b));
}

}  // namespace

double variance_freedom(const GroupedImage& image, int x, int y) {
  const double count = image.count(x, y);
  return std::max(0.0, (image.variance_in_groups ? count : std::min<double>(count, image.groups)) - 1);
}

Planes mean_planes(const GroupedImage& image, const std::vector<unsigned char>& valid, int border, float outside) {
  Planes planes(image.width, image.height, 3, border, outside);
  parallel_for(image.height, 8, [&](int y) {
    for (int x = 0; x < image.width; ++x) {
      if (!valid[static_cast<size_t>(y) * image.width + x]) continue;
      const Spectrum mean = mean_of(image, x, y);
      for (int c = 0; c < 3; ++c) planes.row(c, y)[x] = mean[c];
    }
  });
  return planes;
}

Planes box_mean(const Planes& image, const std::vector<unsigned char>& valid, int window, int border, float outside,
                int plane) {
  const int width = image.width(), height = image.height(), radius = window / 2;
  // For each row, the sums over its windows and their numbers of valid pixels.
  const auto pixels = static_cast<size_t>(width);
  std::vector<double> sums(valid.size());
  std::vector<int> numbers(valid.size());
  const auto add = [pixels](const auto* from, auto* to) {
    for (size_t x = 0; x < pixels; ++x) to[x] += from[x];
  };
  parallel_for(height, 8, [&](int y) {
    const size_t row = static_cast<size_t>(y) * pixels;
    std::vector<double> values(pixels + 2 * radius);
    std::vector<int> ones(pixels + 2 * radius);
    for (size_t x = 0; x < pixels; ++x)
      if (valid[row + x]) values[x + radius] = image.row(plane, y)[x], ones[x + radius] = 1;
    for (int q = 0; q <= 2 * radius; ++q) add(values.data() + q, &sums[row]), add(ones.data() + q, &numbers[row]);
  });
  Planes result(width, height, 1, border, outside);
  parallel_for(height, 8, [&](int y) {
    std::vector<double> sum(pixels);
    std::vector<int> number(pixels);
    for (int q = std::max(0, y - radius); q <= std::min(height - 1, y + radius); ++q) {
      const size_t row = static_cast<size_t>(q) * pixels;
      add(&sums[row], sum.data()), add(&numbers[row], number.data());
    }
    for (size_t x = 0; x < pixels; ++x) result.row(0, y)[x] = number[x] ? static_cast<float>(sum[x] / number[x]) : 0.0f;
  });
  return result;
}

FilterInput filter_input(const GroupedImage& crn, const GroupedImage& independent,
                         const std::vector<unsigned char>& valid, VarianceSource source, int smoothing, int border,
                         Norm norm) {
  FilterInput input;
  input.norm = norm;
  input.dependent = mean_planes(crn, valid, border, kFar);
  input.independent = mean_planes(independent, valid, border, 0);
  input.count = Planes(crn.width, crn.height, 1, border, 0);
  input.variance = Planes(crn.width, crn.height, 1, border, 0);
  parallel_for(crn.height, 8, [&](int y) {
    for (int x = 0; x < crn.width; ++x) {
      if (!valid[static_cast<size_t>(y) * crn.width + x]) continue;
      input.count.row(0, y)[x] = static_cast<float>(independent.count(x, y));
      input.variance.row(0, y)[x] = source == VarianceSource::kBoth ? pooled_variance(crn, independent, x, y, norm)
                                                                    : scalar_variance(crn.sample_variance(x, y), norm);
    }
  });
  if (smoothing > 1) input.variance = box_mean(input.variance, valid, smoothing, border, 0);
  return input;
}

}  // namespace covary
