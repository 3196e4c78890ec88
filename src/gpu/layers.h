// SPDX-License-Identifier: Apache-2.0
// Layers of a denoised picture, denoising/layers.h, on a device: what its candidates are made of. They are filtered and
// mixed as the picture is (filtered_candidates.h, mixture.h).
#pragma once

#include "gpu/denoising_parts.h"

namespace covary::gpu {

struct LayerBuffers {
  Buffer<float> mean;
  Buffer<float> noisy;  ///< without the fireflies of the picture, if the layer is a part of it
};
/// `layer`: with the picture's groups. `limits`: of all groups of the picture; null: it is no part of the picture.
LayerBuffers upload_layer(Device& device, const GroupedImage& layer, const Groups& picture, const Limits* limits,
                          bool planted_bug = false);

/// Bytes of a device's memory for each pixel of the layer that is made, beside those of the picture.
double bytes_of_layer(int groups);

}  // namespace covary::gpu
