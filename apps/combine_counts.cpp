// SPDX-License-Identifier: Apache-2.0
#include "combine_counts.h"

#include <cmath>

#include "core/error.h"

namespace covary {

void take_counts(const std::string& path, std::optional<int> crn_samples, GroupedFile* crn, GroupedFile& independent) {
  if (path.empty()) return;
  independent.take_counts(path);
  if (!crn || crn->has_counts()) return;
  const auto samples = crn_samples ? static_cast<uint32_t>(*crn_samples) : std::lround(crn->samples());
  if (samples == 0)
    throw Error(ErrorCode::kUsage, "--counts needs --samples N, the samples per pixel of the CRN image");
  crn->take_count(static_cast<uint32_t>(samples));
}

}  // namespace covary
