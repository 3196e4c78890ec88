// SPDX-License-Identifier: Apache-2.0
// What a mixture of denoised images (mixed_denoising.h) is made of: the image of all samples and those of both halves
// of them, by the same method, and the independent images that judge them.
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

/// The image of some samples.
struct DenoisingPart {
  EstimatorResult image;  ///< with its standard error; all values are finite
  Moments independent;    ///< of those samples that are independent from pixel to pixel
  /// The mean without fireflies (limited_groups.h); none of a pair.
  std::optional<MeanImage> limited;
};

struct DenoisingParts {
  DenoisingPart whole;
  std::array<DenoisingPart, 2> halves;
  std::vector<unsigned char> valid;  ///< 0: a pixel that is left out
  /// The image is the mean of independent samples: noisy, but without a bias that residual correction could take away.
  bool is_mean = false;
  std::string name = "mean";  ///< of the image
  GroupedImage groups;        ///< the independent samples, whose memory is the caller's
};

/// Means of all pixels.
Image mean_image(const Moments& moments);

/// Of a base estimator of two passes.
DenoisingParts parts_of_pair(const Estimator& base, const GroupedImage& crn, const GroupedImage& independent,
                             const PairSettings& settings);

/// Of independent samples alone: means of their groups, at least two. The variance of a pixel is that between its
/// groups, drawn to the mean of those around it as if these were two groups more: few groups tell little.
/// Halves of one group have that of all groups, from the pixels around alone. Fireflies are judged by the part itself,
/// so that halves remain independent.
DenoisingParts parts_of_mean(const GroupedImage& independent);
/// The same without halves, of any number of groups. A single group has the standard error 0.
DenoisingParts whole_of_mean(const GroupedImage& independent);

}  // namespace covary
