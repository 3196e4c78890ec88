// SPDX-License-Identifier: Apache-2.0
#include "device/launch_pace.h"

#include <algorithm>

namespace covary::device {

void LaunchPace::measured(uint32_t groups, double seconds) {
  constexpr double kMaxGrowth = 8, kMaxGroups = 1 << 30;
  const bool is_rest = groups < groups_ / 2;  // which may not fill the device
  const double wanted = groups * std::clamp(kSeconds / std::max(seconds, 1e-9), 1 / kMaxGrowth, kMaxGrowth);
  if (!is_rest || seconds > kSeconds) groups_ = static_cast<uint32_t>(std::clamp(wanted, 1.0, kMaxGroups));
}

}  // namespace covary::device
