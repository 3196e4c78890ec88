// SPDX-License-Identifier: Apache-2.0
// Layers of a denoised image: parts of the light, such as direct and indirect light, denoised so that they add
// up to the picture. Each layer is made as the picture is, with the picture's weights:
//
//     L_k = d_k + sum_p x_p (C_p,k - d_k),
//
// d_k: mean of the layer's samples, C_p,k: candidate p of the layer. Filters with given weights are linear, so their
// layers add up; a network's do not. The difference from the picture M is distributed in proportion to their values,
//
//     L'_k = L_k + (M - sum_j L_j) |L_k| / sum_j |L_j|,
//
// which scales positive layers. [Zimmer2015] denoise components of the light apart, too. Claim: sum_k L'_k = M up to
// rounding, at every pixel. A picture may be split in several ways; layers that are no part of it, such as alpha, are
// L_k.
#pragma once

#include <span>
#include <vector>

#include "denoising/candidates.h"
#include "denoising/denoising_parts.h"
#include "estimators/method.h"

namespace covary {

struct LayersInput {
  const Image* image = nullptr;  ///< the picture
  const GroupedImage* independent = nullptr;
  std::span<const Layer> layers;
  CandidateInput candidates;  ///< the inputs of the picture's candidates
  std::span<const CandidateMaker> makers;
  std::span<const Image> weights;  ///< of the picture, for the candidates of all makers
  const Planes* shares = nullptr;  ///< CandidateSet::shares of the picture
};

/// The layers, in their order.
std::vector<Image> denoise_layers(const LayersInput& input);

/// Makes layers add up to `image`, as above. They have its size.
void add_up(const Image& image, std::span<Image* const> layers);
/// The same for all that have a sum: images[k] is that of layers[k].
void add_up(const Image& image, std::span<const Layer> layers, std::span<Image> images);

}  // namespace covary
