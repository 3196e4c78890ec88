// SPDX-License-Identifier: Apache-2.0
#include "denoising/denoised_references.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/error.h"
#include "denoising/denoising_parts.h"
#include "film/grouped_image.h"
#include "filters/nl_means.h"

namespace covary {
namespace {

/// Rows at a time, to bound the memory, and how far around they are read: patches of the window, and the variance.
constexpr int kBandRows = 256, kHalo = kNlMeansRadius + 1 + 2;
/// Wide, because the noise that is left counts more than lost detail.
constexpr float kBandwidth = 1;

/// Rows first … end - 1 of both references as the two groups of an image.
std::vector<float> groups_of(std::span<const Image> references, int first, int end) {
  const size_t row = 3 * static_cast<size_t>(references[0].width);
  std::vector<float> data;
  data.reserve(2 * row * static_cast<size_t>(end - first));
  for (size_t i = row * static_cast<size_t>(first); i < row * static_cast<size_t>(end); i += 3)
    for (const Image& image : references) data.insert(data.end(), &image.data[i], &image.data[i] + 3);
  return data;
}

}  // namespace

std::vector<Image> denoised_references(std::span<const Image> references) {
  if (references.size() < 2) return {};
  const int width = references[0].width, height = references[0].height;
  COVARY_CHECK(references.size() == 2, "one or two references");
  if (references[1].width != width || references[1].height != height)
    throw Error(ErrorCode::kInput, fmt::format("one reference has {} x {} pixels, the other {} x {}", width, height,
                                               references[1].width, references[1].height));
  std::vector<Image> result(2, Image(width, height, 3));
  for (int y = 0; y < height; y += kBandRows) {
    const int n = std::min(kBandRows, height - y), first = std::max(0, y - kHalo);
    const int end = std::min(height, y + n + kHalo);
    const std::vector<float> data = groups_of(references, first, end);
    const DenoisingParts parts = parts_of_mean({width, end - first, 2, data.data()});
    std::vector<NlMeansSteering> steerings;
    for (const DenoisingPart& half : parts.halves)
      steerings.push_back({&half.image.estimate, &half.image.std_error, {{kBandwidth, {&half.image.estimate}}}});
    const std::vector<Image> filtered = nl_means(steerings, nullptr, parts.valid);
    for (size_t i = 0; i < result.size(); ++i)
      std::copy_n(filtered[i].pixel(0, y - first), 3 * static_cast<size_t>(width) * n, result[i].pixel(0, y));
  }
  return result;
}

}  // namespace covary
