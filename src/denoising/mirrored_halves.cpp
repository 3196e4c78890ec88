// SPDX-License-Identifier: Apache-2.0
#include "denoising/mirrored_halves.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/parallel.h"

namespace covary {

Image mirrored(Image image, Mirror mirror) {
  const int width = image.width, height = image.height, channels = image.channels;
  if (mirror == Mirror::kColumns)
    parallel_for(height, 16, [&](int y) {
      for (int x = 0; x < width / 2; ++x)
        std::swap_ranges(image.pixel(x, y), image.pixel(x, y) + channels, image.pixel(width - 1 - x, y));
    });
  if (mirror == Mirror::kRows)
    parallel_for(height / 2, 16, [&](int y) {
      std::swap_ranges(image.pixel(0, y), image.pixel(0, y) + width * channels, image.pixel(0, height - 1 - y));
    });
  return image;
}

void denoise_with_halves(std::span<Image> images,
                         const std::function<Image(Image image, Mirror mirror, int part)>& denoise) {
  constexpr Mirror kMirrors[] = {Mirror::kNone, Mirror::kColumns, Mirror::kRows};
  COVARY_CHECK(images.size() == 1 || images.size() == 3, "all samples, or these and both halves");
  for (size_t i = images.size(); i-- > 0;)
    images[i] =
        mirrored(denoise(mirrored(std::move(images[i]), kMirrors[i]), kMirrors[i], static_cast<int>(i)), kMirrors[i]);
  if (images.size() == 1) return;
  std::vector<float>& whole = images[0].data;
  for (size_t i = 0; i < whole.size(); ++i)
    whole[i] = 0.5f * whole[i] + 0.25f * (images[1].data[i] + images[2].data[i]);
}

}  // namespace covary
