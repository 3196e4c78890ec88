// SPDX-License-Identifier: Apache-2.0
// What errors against two noisy references are relative to : the references denoised without a network, each from
// its own values, so that the noise of one does not enter the weight made of the other.
#pragma once

#include <span>
#include <vector>

#include "film/film.h"

namespace covary {

/// For compute_metric() (metrics/metrics.h): of two independent references of the same size and quality, the image that
/// NL-means makes of each; the differences between both tell how noisy they are. Of one reference, nothing: errors are
/// relative to itself. Linear RGB, 3 channels; pixels that are not finite in both have no meaning. Throws Error(kInput)
/// if sizes differ.
std::vector<Image> denoised_references(std::span<const Image> references);

/// Memory that it needs in bytes per pixel, beside the references.
inline constexpr double kBytesOfDenoisedReferences = 2 * 3 * sizeof(float);

}  // namespace covary
