// SPDX-License-Identifier: Apache-2.0
// Denoises images that are too large for memory by bands of rows, with the same bits as at once: bands overlap by the
// radius of influence, and what rows share follows from passes over all of them. First come the numbers of samples and,
// with a network, its images, which see the whole picture; then the weights of a sample of rows (mixture.h); then the
// bands themselves, whose errors are scaled in the end (mixed_rows.h). A band keeps the images of its samples and their
// candidates for the next one, so that these, the larger part of the work, are made once.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "denoising/candidates.h"
#include "denoising/denoising_parts.h"
#include "denoising/parts_mixture.h"

namespace covary {

/// How rows become an image.
struct RowsMethod {
  PartsWeighting weighting;
  CandidateBase base = CandidateBase::kMean;
  int halo_of_parts = 0;  ///< radius of influence of the images on the parts
  std::function<DenoisingParts(const Samples& rows, const MethodSettings& settings)> parts;
  std::function<CandidateMaker(const Features& features, const WantedRows& wanted)> filters;
  std::optional<DenoiseOptions> network;
  /// The image of rows whose samples are too few for a mixture.
  std::function<MethodImage(const Samples& rows, const MethodSettings& settings,
                            const std::vector<CandidateMaker>& makers)>
      of_few;
  /// Whether the rows have enough samples for a mixture.
  std::function<bool(const Samples& rows)> are_enough;
};

/// Radius of influence of the image on a pixel, in rows.
int rows_halo(const RowsMethod& method);

/// Bytes per pixel of the whole image that are needed beside the bands and the result.
double bytes_of_whole(bool with_network);

/// Throws like the estimator.
MethodImage denoise_in_rows(const SamplesInRows& image, const MethodSettings& settings, const RowsMethod& method);

}  // namespace covary
