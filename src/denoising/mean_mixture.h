// SPDX-License-Identifier: Apache-2.0
// A mixture of the mean of independent samples with denoised images, for those that make it elsewhere than on the
// processor: what it is made of.
#pragma once

#include "denoising/candidates.h"
#include "denoising/parts_mixture.h"
#include "film/grouped_image.h"

namespace covary {

struct MeanMixture {
  GroupedImage independent;  ///< of two groups or more, and kFewestMixedSamples samples or more in each pixel
  Guides guides;
  FilterKinds kinds = FilterKinds::kRegression;
  PartsWeighting weighting;
  bool std_error = false;  ///< estimate the result's error
  bool stages = false;     ///< candidates and weights are wanted, too
};

}  // namespace covary
