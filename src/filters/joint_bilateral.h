// SPDX-License-Identifier: Apache-2.0
// A small built-in denoiser for when Open Image Denoise is not installed: the mean over neighbours with similar albedo
// and normal, a joint bilateral filter [Petschnigg2004].
//
// Biased, blurs shadows and highlights; intended for rough estimates of pixel values, not for final images.
#pragma once

#include "film/film.h"

namespace covary {

/// Filters `rgb` (3 channels, linear), guided by `albedo` in [0, 1] and `normal` in [-1, 1] of the same size.
/// Non-finite values are ignored; a pixel without any finite neighbour becomes black. Bit-identical for any number of
/// threads. Throws Error(kInput) when sizes differ.
Image joint_bilateral(const Image& rgb, const Image& albedo, const Image& normal);

}  // namespace covary
