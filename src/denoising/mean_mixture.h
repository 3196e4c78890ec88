// SPDX-License-Identifier: Apache-2.0
// A mixture of an image with denoised images, for those that make it elsewhere than on the processor: what it is made
// of.
#pragma once

#include <array>
#include <functional>
#include <span>
#include <vector>

#include "denoising/candidates.h"
#include "denoising/denoising_choice.h"
#include "denoising/parts_mixture.h"
#include "estimators/method.h"
#include "film/grouped_image.h"

namespace covary {

struct MeanMixture {
  GroupedImage independent;  ///< of two groups or more, and kMinMixedSamples samples or more in each pixel
  Features features;
  FilterKinds kinds = FilterKinds::kRegression;
  PartsWeighting weighting;
  /// A network's images, whose candidates come first: of all samples and of both halves; empty: without one.
  std::function<NetworkImages(std::array<Image, 3> noisy)> network;
  bool std_error = false;              ///< estimate the result's error
  bool stages = false;                 ///< candidates and weights are wanted, too
  std::span<const Layer> layers = {};  ///< to be denoised with the mixture's weights (layers.h)
  /// What the network makes of layers; empty: without one.
  std::function<NetworkLayers(std::vector<Image> noisy)> network_of_layers = {};
  MixingHistory history = {};  ///< of a frame, following its features
};

/// The image of an estimator of two passes.
struct PairMixture {
  const DenoisingParts* parts = nullptr;  ///< with features
  PartsWeighting weighting;
  std::function<NetworkImages()> network;  ///< of the independent images; their candidate comes last; empty: without
  bool std_error = false, stages = false;  ///< as for a mean
  MixingHistory history = {};              ///< likewise
};

}  // namespace covary
