// SPDX-License-Identifier: Apache-2.0
// Mixes the history (history.h) into the mixture of a frame.
#pragma once

#include <vector>

#include "denoising/mixed_denoising.h"
#include "denoising/parts_mixture.h"

namespace covary {

/// Mixes in the history, and keeps samples for the next frame if a network denoises: filtered from reprojected samples,
/// a region of a frame with a moving camera had 1.65 times the error of the frame alone.
void use_history(const MixingHistory& use, const DenoisingParts& parts, const std::vector<CandidateMaker>& makers,
                 const PartsWeighting& chosen, const Image& frame_error, MixedParts& mixed,
                 std::vector<Image>& kept_samples);

}  // namespace covary
