// SPDX-License-Identifier: Apache-2.0
// The variance of the samples of a pixel, from what a film keeps of them.
#pragma once

#include <cstdint>

#include "core/spectrum.h"

namespace covary {

/// Estimates the variance of one sample of each channel, unbiased, from a pixel's `count` samples in `groups` groups
/// with the sizes of film/groups.h. `means`: groups x RGB. `in_groups`: mean squared deviation of the samples from the
/// mean of their group, RGB, as films may keep it; all samples then count. Null: the means alone tell, with a relative
/// standard error of about sqrt(2 / (groups - 1)). Zero where fewer than two samples, or groups with samples, tell
/// nothing.
Spectrum sample_variance(const float* means, const float* in_groups, int groups, uint32_t count);

}  // namespace covary
