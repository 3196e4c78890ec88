// SPDX-License-Identifier: Apache-2.0
// The inputs of a mixture of denoised images (mixed_denoising.h): the image of all samples and those of both halves,
// made by the same method, and the independent images that judge them.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "estimators/estimator.h"
#include "filters/planes.h"

namespace covary {

/// The mean of independent samples.
struct MeanImage {
  Image estimate, std_error;
  Moments independent;
};

/// The image of a set of samples.
struct DenoisingPart {
  EstimatorResult image;  ///< with its standard error; all values are finite
  Moments independent;    ///< mean of the independent samples of the set
  /// The mean without fireflies (limited_groups.h); empty for a pair.
  std::optional<MeanImage> limited;
};

struct DenoisingParts {
  DenoisingPart whole;
  std::array<DenoisingPart, 2> halves;
  std::vector<unsigned char> valid;  ///< 0: the pixel is left out
  /// The image is the mean of independent samples: noisy, but without a bias for residual correction to remove.
  bool is_mean = false;
  std::string name = "mean";  ///< of the image
  GroupedImage groups;        ///< the independent samples; the caller owns the memory
  Guides guides;              ///< tell the pixels seen in mirrors and through glass; the caller owns the memory
};

/// Means of all pixels.
Image mean_image(const Moments& moments);

/// For a base estimator of two passes.
DenoisingParts parts_of_pair(const Estimator& base, const GroupedImage& crn, const GroupedImage& independent,
                             const PairSettings& settings);

/// For independent samples alone: means of their groups, at least two. The variance between the groups of a pixel is
/// shrunk towards the mean of the surrounding pixels, which counts as two more groups, because few groups determine a
/// variance poorly. Halves of a single group have the variance of all groups, from the surrounding pixels alone.
/// Fireflies are judged within each part, so that halves stay independent.
DenoisingParts parts_of_mean(const GroupedImage& independent);
/// The same without halves, for any number of groups. A single group has a standard error of 0.
DenoisingParts whole_of_mean(const GroupedImage& independent);

}  // namespace covary
