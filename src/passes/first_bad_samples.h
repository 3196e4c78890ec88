// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "passes/render_pass.h"

namespace covary {

/// Sorts by pixel and sample and keeps the first few; which ones does not depend on the order they came in.
void keep_first(std::vector<BadSample>& samples);

}  // namespace covary
