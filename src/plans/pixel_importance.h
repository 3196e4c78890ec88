// SPDX-License-Identifier: Apache-2.0
// What integrators that learn are told of the image before they begin.
#pragma once

#include <atomic>
#include <vector>

#include "film/film.h"
#include "scene/scene.h"

namespace covary {

/// How much an error counts in each channel of each pixel, so that relative errors count alike: 1 / √(value² + 0.01),
/// with the value of the denoised film ([Hua2023] Eq. 25) and the constant of relMSE. Denoised by joint_bilateral(), or
/// by Open Image Denoise, which then has to be installed. Empty when stopped.
std::vector<Spectrum> pixel_importance(const Scene& scene, const FilterSettings& filter, const Film& film, bool by_oidn,
                                       const std::atomic<bool>* stop);

}  // namespace covary
