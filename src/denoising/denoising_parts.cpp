// SPDX-License-Identifier: Apache-2.0
#include "denoising/denoising_parts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "core/parallel.h"
#include "denoising/limited_groups.h"
#include "filters/filter_input.h"
#include "risk/halves.h"

namespace covary {
namespace {

/// Weight of the surrounding pixels' variance, in groups, and the side of their window.
constexpr float kPriorFreedom = 8;
constexpr int kVarianceWindow = 5;
static_assert(kLimitWindow / 2 + kVarianceWindow / 2 <= kMeanHalo);

/// Sets non-finite values to 0: pixels that the estimator leaves out may hold anything.
void make_finite(Image& image) {
  for (float& value : image.data)
    if (!std::isfinite(value)) value = 0;
}

DenoisingPart part_of_pair(const Method& base, const GroupedImage& crn, const GroupedImage& independent,
                           MethodSettings settings, const std::vector<unsigned char>& valid) {
  settings.std_error = true;
  settings.held_out = false;
  DenoisingPart part;
  part.image = base.image({crn, independent}, settings);
  part.independent = moments(independent, valid, 0, 0.0f);
  make_finite(part.image.estimate), make_finite(part.image.std_error);
  return part;
}

/// Root of `scale` times the variance, which has `freedom` degrees of freedom, shrunk towards that of the surrounding
/// pixels: their power mean with an exponent of 3/4, so that a bright light's noise hardly leaks into dark neighbours.
Image std_error_of(const Planes& variance, const std::vector<unsigned char>& valid, int freedom, float scale) {
  Image result(variance.width(), variance.height(), 3);
  std::array<Planes, 3> around;
  Planes lessened(result.width, result.height, 3, 0, 0);
  parallel_for(result.height, 8, [&](int y) {
    for (int c = 0; c < 3; ++c)
      std::transform(variance.row(c, y), variance.row(c, y) + result.width, lessened.row(c, y),
                     [](float v) { return std::sqrt(v) * std::sqrt(std::sqrt(v)); });
  });
  for (int c = 0; c < 3; ++c) around[c] = box_mean(lessened, valid, kVarianceWindow, 0, 0, c);
  const float own = static_cast<float>(freedom) / (static_cast<float>(freedom) + kPriorFreedom);
  parallel_for(result.height, 8, [&](int y) {
    for (int x = 0; x < result.width; ++x)
      for (int c = 0; c < 3; ++c) {
        if (!valid[static_cast<size_t>(y) * result.width + x]) continue;
        const float lessened_mean = around[c].row(0, y)[x], mean = lessened_mean * std::cbrt(lessened_mean);
        result.pixel(x, y)[c] = std::sqrt(scale * (own * variance.row(c, y)[x] + (1 - own) * mean));
      }
  });
  return result;
}

MeanImage mean_with_error(const GroupedImage& image, const std::vector<unsigned char>& valid) {
  MeanImage mean;
  mean.independent = moments(image, valid, 0, 0.0f);
  mean.estimate = mean_image(mean.independent);
  mean.std_error = std_error_of(mean.independent.variance_of_mean, valid, image.groups - 1, 1);
  return mean;
}

DenoisingPart part_of_mean(const GroupedImage& image, const std::vector<unsigned char>& valid) {
  MeanImage mean = mean_with_error(image, valid);
  DenoisingPart part;
  part.independent = std::move(mean.independent);
  part.image.estimate = std::move(mean.estimate);
  part.image.std_error = std::move(mean.std_error);
  if (image.groups > 1) part.limited = mean_with_error(LimitedGroups(image, valid).view(), valid);
  return part;
}

}  // namespace

Image mean_image(const Moments& moments) {
  const Planes& planes = moments.mean;
  Image image(planes.width(), planes.height(), 3);
  parallel_for(image.height, 16, [&](int y) {
    for (int x = 0; x < image.width; ++x)
      for (int c = 0; c < 3; ++c) image.pixel(x, y)[c] = planes.row(c, y)[x];
  });
  return image;
}

DenoisingParts parts_of_pair(const Method& base, const GroupedImage& crn, const GroupedImage& independent,
                             const MethodSettings& settings) {
  DenoisingParts parts;
  parts.name = base.name;
  parts.groups = independent;
  long ignored = 0;  // the base counts them
  parts.valid = finite_pixels(crn, independent, ignored);
  parts.whole = part_of_pair(base, crn, independent, settings, parts.valid);
  for (int half : {0, 1}) {
    const HalfImage half_crn(crn, half), half_independent(independent, half);
    MethodSettings half_settings = settings;
    half_settings.crn_samples = std::max<int64_t>(1, settings.crn_samples / 2);
    parts.halves[half] = part_of_pair(base, half_crn.view(), half_independent.view(), half_settings, parts.valid);
  }
  return parts;
}

DenoisingParts whole_of_mean(const GroupedImage& independent) {
  DenoisingParts parts;
  parts.is_mean = true;
  parts.groups = independent;
  long n_nonfinite = 0;
  parts.valid = finite_pixels(independent, independent, n_nonfinite);
  parts.whole = part_of_mean(independent, parts.valid);
  fill_invalid(independent, independent, parts.valid, parts.whole.image.estimate);
  parts.whole.image.nonfinite_pixels = n_nonfinite;
  return parts;
}

DenoisingParts parts_of_mean(const GroupedImage& independent) {
  DenoisingParts parts = whole_of_mean(independent);
  for (int half : {0, 1}) {
    const HalfImage image(independent, half);
    const int groups = image.view().groups;
    DenoisingPart& part = parts.halves[half];
    part = part_of_mean(image.view(), parts.valid);
    if (groups > 1) continue;
    // A single group has no variance. The window's mean gives it: the pixel's own would depend on the other half.
    const float more = static_cast<float>(independent.groups) / static_cast<float>(groups);
    const Planes& all = parts.whole.independent.variance_of_mean;
    part.image.std_error = std_error_of(all, parts.valid, 0, more);
    for (int c = 0; c < 3; ++c)
      for (int y = 0; y < independent.height; ++y)
        std::transform(all.row(c, y), all.row(c, y) + independent.width, part.independent.variance_of_mean.row(c, y),
                       [more](float v) { return more * v; });
  }
  return parts;
}

}  // namespace covary
