// SPDX-License-Identifier: Apache-2.0
#include "film/sample_variance.h"

#include <algorithm>
#include <cmath>

#include "film/groups.h"

namespace covary {

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
