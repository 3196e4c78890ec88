// SPDX-License-Identifier: Apache-2.0
#include "denoising/mirrored_halves.h"

#include <algorithm>

#include "core/error.h"
#include "core/parallel.h"

namespace covary {

Image mirrored(const Image& image, Mirror mirror) {
  if (mirror == Mirror::kNone) return image;
  Image result(image.width, image.height, image.channels);
  parallel_for(image.height, 16, [&](int y) {
    for (int x = 0; x < image.width; ++x) {
      const float* from = image.pixel(mirror == Mirror::kColumns ? image.width - 1 - x : x,
                                      mirror == Mirror::kRows ? image.height - 1 - y : y);
      std::copy_n(from, image.channels, result.pixel(x, y));
    }
  });
  return result;
}

std::vector<Image> denoise_with_halves(std::span<const Image* const> images,
                                       const std::function<Image(const Image& image, Mirror mirror)>& denoise) {
  constexpr Mirror kMirrors[] = {Mirror::kNone, Mirror::kColumns, Mirror::kRows};
  COVARY_CHECK(images.size() == 1 || images.size() == 3, "all samples, or these and both halves");
  std::vector<Image> results;
  for (size_t i = 0; i < images.size(); ++i)
    results.push_back(mirrored(denoise(mirrored(*images[i], kMirrors[i]), kMirrors[i]), kMirrors[i]));
  if (images.size() == 1) return results;
  std::vector<float>& whole = results[0].data;
  for (size_t i = 0; i < whole.size(); ++i)
    whole[i] = 0.5f * whole[i] + 0.25f * (results[1].data[i] + results[2].data[i]);
  return results;
}

}  // namespace covary
