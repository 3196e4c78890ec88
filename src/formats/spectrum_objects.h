// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "scene/parameters.h"

namespace covary {

/// The value of a <spectrum type="…"> object: "uniform", "regular", "irregular", "srgb", "rgb", "d65" or "blackbody".
/// Null ObjectPtr after recording an error.
Value spectrum_value(const ObjectPtr& object, Diagnostics& diagnostics);

}  // namespace covary
