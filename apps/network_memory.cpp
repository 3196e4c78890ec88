// SPDX-License-Identifier: Apache-2.0
#include "network_memory.h"

#include <fmt/format.h>

#include "core/error.h"
#include "core/memory_limit.h"
#include "denoising/network_memory.h"

namespace covary {

/// Throws if the network needs too much: per pixel, images (the input, a copy, features while they are read and the
/// result) and, in tiles of limited size, its own values.
void require_memory_of_network(const std::string& input, const CropWindow& window,
                               std::optional<double> permitted_mib) {
  constexpr double kImageBytes = 7 * 3 * sizeof(float), kMebibyte = 1 << 20;
  const double n_pixels = static_cast<double>(window.width) * window.height;
  const double bytes = n_pixels * kImageBytes + network_library_memory() + network_tile_memory(n_pixels);
  if (permitted_mib && bytes > *permitted_mib * kMebibyte)
    throw Error(
        ErrorCode::kUsage,
        fmt::format("{}: an image of {} x {} pixels needs {} of memory for Open Image Denoise; {} are allowed "
                    "(--memory)",
                    input, window.width, window.height, bytes_text(bytes), bytes_text(*permitted_mib * kMebibyte)));
  require_memory(input, fmt::format("an image of {} x {} pixels", window.width, window.height), bytes);
}

}  // namespace covary
