// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "combine/input_checks.h"

namespace covary {

/// InputChecks for whole images.
inline InputReport examine_inputs(const GroupedImage& crn, const GroupedImage& independent) {
  InputChecks checks(crn.width, crn.height, crn.groups, independent.groups);
  checks.add_rows(crn, independent);
  return checks.report();
}

}  // namespace covary
