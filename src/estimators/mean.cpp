// SPDX-License-Identifier: Apache-2.0
#include "estimators/mean.h"

#include <cmath>
#include <limits>

#include "film/groups.h"

namespace covary {
namespace {

struct ChannelMean {
  double mean = 0, std_error = 0;
};

/// Over T values with stride 3, each from the same number of samples.
ChannelMean mean_of_equal(const float* groups, int T) {
  double sum = 0, squares = 0;
  for (int t = 0; t < T; ++t) sum += groups[3 * t];
  for (int t = 0; t < T; ++t) squares += std::pow(groups[3 * t] - sum / T, 2);
  return {sum / T, T > 1 ? std::sqrt(squares / (T - 1) / T) : 0};
}

/// Same for `count` samples in groups of unequal sizes; empty groups are ignored.
ChannelMean mean_of_unequal(const float* groups, int T, uint32_t count) {
  const auto used = static_cast<int>(std::min<uint32_t>(T, count));
  double sum = 0, squares = 0;
  for (int t = 0; t < used; ++t) sum += static_cast<double>(group_size(count, T, t)) * groups[3 * t];
  const double mean = used > 0 ? sum / count : 0;
  if (used < 2) return {mean, std::numeric_limits<double>::infinity()};
  for (int t = 0; t < used; ++t) squares += group_size(count, T, t) * std::pow(groups[3 * t] - mean, 2);
  return {mean, std::sqrt(squares / (used - 1) / count)};
}

/// Standard error of the mean of `count` samples.
double error_of_samples(double variance, uint32_t count) {
  return count > 1 ? std::sqrt(variance / count) : std::numeric_limits<double>::infinity();
}

}  // namespace

EstimatorResult mean_of_groups(const GroupedImage& image) {
  const int T = image.groups;
  EstimatorResult result;
  result.estimate = Image(image.width, image.height, 3);
  const bool has_error = T > 1 || image.variance_in_groups;
  if (has_error) result.std_error = Image(image.width, image.height, 3);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      const uint32_t count = image.count(x, y);
      const bool equal = count > 0 && image.has_equal_groups(x, y);
      const Spectrum variance = image.variance_in_groups ? image.sample_variance(x, y) : Spectrum(0);
      for (int c = 0; c < 3; ++c) {
        const float* groups = image.pixel(x, y) + c;
        const ChannelMean m = equal ? mean_of_equal(groups, T) : mean_of_unequal(groups, T, count);
        result.estimate.pixel(x, y)[c] = static_cast<float>(m.mean);
        if (has_error)
          result.std_error.pixel(x, y)[c] =
              static_cast<float>(image.variance_in_groups ? error_of_samples(variance[c], count) : m.std_error);
      }
    }
  return result;
}

}  // namespace covary
