// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "scene/parameters.h"

namespace covary {

/// Types of <spectrum type="…">.
const std::vector<std::string>& spectrum_types();
/// Whether there are objects <spectrum type="…"> of this type; <texture type="…"> means the same.
bool is_spectrum_type(std::string_view type);

/// The value of such an object: a number, a colour, a sampled spectrum, or the texture that a `d65` scales. A null
/// ObjectPtr after recording an error.
Value spectrum_value(const ObjectPtr& object, Diagnostics& diagnostics);

}  // namespace covary
