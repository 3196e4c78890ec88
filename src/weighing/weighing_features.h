// SPDX-License-Identifier: Apache-2.0
// What the network that weighs candidates sees of each cell of 2 x 2 pixels: how the images differ, how noisy they are,
// and auxiliary features, all relative to the local brightness. Only sums, products, quotients and roots, so that every
// processor gives the same bits.
#pragma once

#include <span>

#include "film/film.h"
#include "filters/planes.h"

namespace covary {

/// Auxiliary features: albedo and normal, of the first surface and of those behind mirrors and glass; all or none.
struct WeighingSurfaces {
  const Image *albedo = nullptr, *normal = nullptr, *denoising_albedo = nullptr, *denoising_normal = nullptr;
};

struct WeighingInput {
  const Image* mean = nullptr;        ///< of the samples
  std::span<const Image> candidates;  ///< made of it
  const Image* std_error = nullptr;   ///< of the mean without fireflies
  WeighingSurfaces surfaces;
};

/// Side of a cell in pixels.
inline constexpr int kWeighedCell = 2;

/// Number of features with so many candidates.
constexpr int n_weighing_features(int candidates) { return 2 * candidates + 15; }

/// The features, without border. The last cells are repeated until rows and columns are multiples of `multiple`.
Planes weighing_features(const WeighingInput& input, int multiple);

}  // namespace covary
