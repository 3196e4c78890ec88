// SPDX-License-Identifier: Apache-2.0
// The inputs of a mixture of denoised images (mixed_denoising.h): images of all samples and of both halves, made by the
// same method, and the held-out independent images that they are compared with.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "estimators/method.h"
#include "filters/planes.h"

namespace covary {

/// The mean of independent samples.
struct MeanImage {
  Image estimate, std_error;
  Moments independent;
};

/// The image of a set of samples.
struct DenoisingPart {
  EstimatorResult image;  ///< with standard error; all values are finite
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
  Features features;          ///< identify pixels that see mirrors or glass; the caller owns the memory
};

/// The mean of each pixel, 3 channels.
Image mean_image(const Moments& moments);

/// For a base estimator of two passes.
DenoisingParts parts_of_pair(const Method& base, const GroupedImage& crn, const GroupedImage& independent,
                             const MethodSettings& settings);

/// For independent samples alone: means of at least two groups. A few groups determine a variance poorly, so the
/// variance between the groups of a pixel is shrunk towards that of the surrounding pixels, which counts as eight more
/// groups. A half of a single group takes its variance from all groups, of the surrounding pixels alone. Fireflies are
/// limited within each part, so that halves stay independent.
DenoisingParts parts_of_mean(const GroupedImage& independent);
/// Radius of influence of the samples on the parts of a mean, in rows; and on the pixels that a two-pass estimator
/// fills in for those that are left out.
inline constexpr int kMeanHalo = 8, kFilledHalo = 4;
/// The same without halves, for any number of groups. The standard error of a single group is 0.
DenoisingParts whole_of_mean(const GroupedImage& independent);

}  // namespace covary
