// SPDX-License-Identifier: Apache-2.0
// A light film beside the images of `covary combine`.
#pragma once

#include <vector>

#include "estimators/grouped_file.h"
#include "estimators/input_checks.h"

namespace covary {

/// What the files say about light films: `light` may be null. Throws Error(kInput) where it is no light film, or shows
/// other pixels.
void check_light_files(const GroupedFile& crn, const GroupedFile& independent, const GroupedFile* light,
                       std::vector<Finding>& findings);

/// Adds the light film to the result, some rows at a time. Throws Error(kInput) where a standard error is wanted of one
/// group.
void add_light_file(const GroupedFile& light, EstimatorResult& result);

}  // namespace covary
