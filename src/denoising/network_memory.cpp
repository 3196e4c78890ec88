// SPDX-License-Identifier: Apache-2.0
#include "denoising/network_memory.h"

#include <algorithm>

namespace covary {

double network_library_memory() { return 40e6; }

double network_tile_memory(double n_pixels) {
  constexpr double kBytesOfPixel = 600, kLargestTile = 2160.0 * 2160;
  return std::min(n_pixels, kLargestTile) * kBytesOfPixel;
}

}  // namespace covary
