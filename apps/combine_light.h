// SPDX-License-Identifier: Apache-2.0
// A light film beside the images of `covary combine`.
#pragma once

#include "estimators/grouped_file.h"

namespace covary {

/// Adds the light film to the result, some rows at a time. Throws Error(kInput) where a standard error is wanted of one
/// group.
void add_light_file(const GroupedFile& light, EstimatorResult& result);

}  // namespace covary
