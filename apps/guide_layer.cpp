// SPDX-License-Identifier: Apache-2.0
#include "guide_layer.h"

#include <algorithm>

#include "denoising/denoise.h"

namespace covary {

std::optional<Image> guide_layer(const std::string& path, const ImageInfo& info, const std::string& name) {
  const auto n = std::count_if(info.channels.begin(), info.channels.end(),
                               [&](const ExrFile::Channel& c) { return c.name.starts_with(name + "."); });
  if (n != 3) return std::nullopt;
  Image guide = read_image(path, name).image;
  check_guide(path + ": the layer " + name, guide);
  return guide;
}

}  // namespace covary
