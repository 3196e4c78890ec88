// SPDX-License-Identifier: Apache-2.0
// A small denoiser of our own, for where Open Image Denoise is not installed: the mean over neighbours that look alike
// in albedo and normal, a joint bilateral filter [Petschnigg2004].
//
// Claim: biased, blurs shadows and highlights; made for rough estimates of pixel values, not for images.
#pragma once

#include "film/film.h"

namespace covary {

/// Filters `rgb` (3 channels, linear) by the guides `albedo` in [0, 1] and `normal` in [-1, 1] of the same size. Values
/// that are not finite are left out; a pixel without any finite neighbour is black. The same bits for any number of
/// threads. Throws Error(kInput) when sizes differ.
Image joint_bilateral(const Image& rgb, const Image& albedo, const Image& normal);

}  // namespace covary
