// SPDX-License-Identifier: Apache-2.0
// Sizes of launches.
#pragma once

#include "device/device.h"

namespace covary::gpu {

/// Work groups of kernels with an item for each pixel, or value, of a list, and of an image.
inline constexpr device::Range kOfList{256}, kOfImage{32, 8};

inline device::Range list_of(size_t n) { return {static_cast<uint32_t>(n)}; }
inline device::Range image_of(int width, int height) {
  return {static_cast<uint32_t>(width), static_cast<uint32_t>(height)};
}

/// Side of the cells of kernels/guided_cells.h and kernels/held_out_bias.cl, and how many cover so many pixels.
inline constexpr int kCell = 4;
inline int cells_in(int pixels) { return (pixels + kCell - 1) / kCell; }

/// Definitions of a kernel, with its planted bug for tests.
inline std::vector<std::string> with_bug(std::vector<std::string> definitions, bool planted_bug) {
  definitions.emplace_back(planted_bug ? "PLANTED_BUG=1" : "PLANTED_BUG=0");
  return definitions;
}

}  // namespace covary::gpu
