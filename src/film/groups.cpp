// SPDX-License-Identifier: Apache-2.0
#include "film/groups.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace covary {

int choose_groups(std::span<const uint32_t> counts) {
  constexpr uint32_t kMax = 12, kMinEqual = 8;
  for (uint32_t groups = kMax; groups >= kMinEqual; --groups)
    if (std::all_of(counts.begin(), counts.end(), [&](uint32_t n) { return n > 0 && n % groups == 0; }))
      return static_cast<int>(groups);
  uint32_t groups = kMax;
  for (uint32_t n : counts) groups = std::min(groups, n);
  return static_cast<int>(std::max(groups, 1u));
}

std::vector<uint32_t> split_samples(uint32_t total, std::span<const double> parts, uint32_t fewest) {
  std::vector<uint32_t> samples;
  double parts_left = std::accumulate(parts.begin(), parts.end(), 0.0);
  uint64_t left = total;
  for (size_t i = 0; i < parts.size(); ++i) {
    // Leave enough for the remaining parts. 1e-9: parts are rounded.
    const uint64_t later = uint64_t{fewest} * (parts.size() - 1 - i);
    const uint64_t most = std::max<uint64_t>(left > later ? left - later : 0, fewest);
    const auto share = static_cast<uint64_t>(static_cast<double>(left) * parts[i] / parts_left + 0.5 + 1e-9);
    const uint64_t n = i + 1 == parts.size() ? most : std::clamp<uint64_t>(share, fewest, most);
    samples.push_back(static_cast<uint32_t>(n));
    left -= std::min(n, left);
    parts_left -= parts[i];
  }
  return samples;
}

std::vector<uint32_t> split_into_whole_groups(uint32_t total, std::span<const double> parts, int groups) {
  const auto T = static_cast<uint32_t>(groups);
  std::vector<uint32_t> samples;
  for (double part : parts) {
    const auto share = static_cast<uint32_t>(std::ceil(part * total - 1e-9));
    samples.push_back((std::max(share, 1u) + T - 1) / T * T);
  }
  return samples;
}

Spectrum sample_variance(const float* means, const float* in_groups, int groups, uint32_t count) {
  const auto used = static_cast<int>(std::min(static_cast<uint32_t>(groups), count));
  const double freedom = in_groups ? static_cast<double>(count) - 1 : used - 1.0;
  if (used < 1 || freedom < 1) return Spectrum(0);
  float variance[3];
  for (int c = 0; c < 3; ++c) {
    double sum = 0, squares = in_groups ? static_cast<double>(count) * in_groups[c] : 0;
    for (int g = 0; g < used; ++g) sum += static_cast<double>(group_size(count, groups, g)) * means[3 * g + c];
    const double mean = sum / count;
    for (int g = 0; g < used; ++g) squares += group_size(count, groups, g) * std::pow(means[3 * g + c] - mean, 2);
    variance[c] = static_cast<float>(squares / freedom);
  }
  return {variance[0], variance[1], variance[2]};
}

}  // namespace covary
