// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "scene/parameters.h"

namespace covary {

/// A text that two descriptions without nested objects share exactly when they describe the same thing: equal kind,
/// type and parameters in any order. Ids and places in the file do not matter.
std::string description_key(const ObjectDescription& object);

}  // namespace covary
