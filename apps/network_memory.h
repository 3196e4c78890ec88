// SPDX-License-Identifier: Apache-2.0
// What Open Image Denoise needs for a single render.
#pragma once

#include <optional>
#include <string>

#include "film/film.h"

namespace covary {

/// Throws Error(kUsage) naming the file if denoising the window by the network takes more than `permitted_mib` (none:
/// the machine's limit) of memory.
void require_memory_of_network(const std::string& input, const CropWindow& window, std::optional<double> permitted_mib);

}  // namespace covary
