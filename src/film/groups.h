// SPDX-License-Identifier: Apache-2.0
// How the samples of a pixel are divided into groups, and a number of samples among passes.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/spectrum.h"

namespace covary {

/// Samples that `group` has of the `count` samples of a pixel: sample s belongs to group s mod `groups`.
constexpr uint32_t group_size(uint32_t count, int groups, int group) {
  const auto T = static_cast<uint32_t>(groups);
  return count / T + (static_cast<uint32_t>(group) < count % T ? 1 : 0);
}

/// How many groups films of `counts` samples per pixel keep where nobody asks for a number: the largest from 8 to 12
/// that divides all counts, so that groups have equal sizes, otherwise 12, as in [YM2025] Sec. 5, or as many as the
/// smallest count where that is less. At least 1.
int choose_groups(std::span<const uint32_t> counts);

/// Divides `total` in proportion to `parts` (all > 0, 1 together), so that the numbers add up to `total`; halves go to
/// the first parts. No number is below `fewest`, so that the sum is larger than `total` where that has to be.
std::vector<uint32_t> split_samples(uint32_t total, std::span<const double> parts, uint32_t fewest);

/// The same, each number rounded up to a multiple of `groups`: where a total is only about what is wanted.
std::vector<uint32_t> split_into_whole_groups(uint32_t total, std::span<const double> parts, int groups);

// The variance of the samples of a pixel, from what a film keeps of them.

/// Estimates the variance of one sample of each channel, unbiased, from a pixel's `count` samples in `groups` groups
/// with the sizes of film/groups.h. `means`: groups x RGB. `in_groups`: mean squared deviation of the samples from the
/// mean of their group, RGB, as films may keep it; all samples then count. Null: the means alone tell, with a relative
/// standard error of about sqrt(2 / (groups - 1)). Zero where fewer than two samples, or groups with samples, tell
/// nothing.
Spectrum sample_variance(const float* means, const float* in_groups, int groups, uint32_t count);

}  // namespace covary
