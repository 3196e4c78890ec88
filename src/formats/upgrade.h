// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "scene/parameters.h"

namespace covary {

/// "intIOR" -> "int_ior", "toWorld" -> "to_world": a capital after a lower-case letter starts a new word.
std::string snake_case(std::string_view name);

/// Brings one object of a file of version 0.x or 1.x to the names of version 3. Things of the old renderer that change
/// no image we compute (gamma of the output file, …) are dropped, with a warning.
void upgrade_object(ObjectDescription& object, Diagnostics& diagnostics);

}  // namespace covary
