// SPDX-License-Identifier: Apache-2.0
// A network's candidates on a device: its images, made elsewhere, with residual correction (neural_candidates() of
// denoising/candidates.h).
#pragma once

#include "film/film.h"
#include "gpu/denoising_parts.h"

namespace covary::gpu {

/// Number of a network's candidates of a mean.
inline constexpr int kNetworkCandidates = 3;

/// The number of samples of each pixel in a set of groups relative to their mean; no elements if all have the same.
Buffer<float> relative_counts_of(Device& device, const GroupedImage& image, const GroupSet& set);

/// Writes to the beginning of `results` the network's image `clean` of a part, and that image with residual correction
/// in two widths, one after another.
void write_network_candidates(Device& device, const Groups& groups, const PartBuffers& part,
                              const Buffer<float>& relative_counts, const Image& clean, const Buffer<float>& results,
                              bool planted_bug = false);

}  // namespace covary::gpu
