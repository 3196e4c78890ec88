// SPDX-License-Identifier: Apache-2.0
// What integrators that learn are told of the image before they begin.
#pragma once

#include <atomic>
#include <optional>
#include <vector>

#include "denoising/denoise.h"
#include "film/film.h"
#include "scene/scene.h"

namespace covary {

/// How much an error counts in each channel of each pixel, so that relative errors count alike: 1 / √(value² + 0.01),
/// with the value of the denoised film ([Hua2023] Eq. 25) and the constant of relMSE. Denoised by joint_bilateral(), or
/// with `oidn` by Open Image Denoise, which then has to be there. Empty when stopped.
std::vector<Spectrum> pixel_importance(const Scene& scene, const FilterSettings& filter, const Film& film,
                                       const std::optional<DenoiseOptions>& oidn, const std::atomic<bool>* stop);

}  // namespace covary
