// SPDX-License-Identifier: Apache-2.0
// How a pixel's samples are divided into groups, and a number of samples among passes.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/spectrum.h"

namespace covary {

/// Samples in `group`, of a pixel's `count` samples: sample s belongs to group s mod `groups`.
constexpr uint32_t group_size(uint32_t count, int groups, int group) {
  const auto T = static_cast<uint32_t>(groups);
  return count / T + (static_cast<uint32_t>(group) < count % T ? 1 : 0);
}

/// Default number of groups for films of `counts` samples per pixel: the largest from 8 to 12 that divides all counts,
/// so that groups have equal sizes; otherwise 12, as in [YM2025] Sec. 5, or the smallest count if that is less. At
/// least 1.
int choose_groups(std::span<const uint32_t> counts);

/// Divides `total` in proportion to `parts` (all > 0, summing to 1), so that the results sum to `total`; halves are
/// rounded up for the first parts. No result is below `fewest`, which may make the sum larger than `total`.
std::vector<uint32_t> split_samples(uint32_t total, std::span<const double> parts, uint32_t fewest);

/// Same, with each number rounded up to a multiple of `groups`, so that `total` is met only approximately.
std::vector<uint32_t> split_into_whole_groups(uint32_t total, std::span<const double> parts, int groups);

// The variance of a pixel's samples, from what a film keeps of them.

/// Unbiased estimate, per channel, of the variance of one sample, from a pixel's `count` samples in `groups` groups of
/// sizes group_size(). `means`: groups x RGB. `in_groups`: mean squared deviation of the samples from the mean of their
/// group, RGB, as films may keep it; all samples then count. Null: from the means alone, with a relative standard error
/// of about sqrt(2 / (groups - 1)). Zero if there are fewer than two samples, or fewer than two groups with samples.
Spectrum sample_variance(const float* means, const float* in_groups, int groups, uint32_t count);

}  // namespace covary
