// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "scene/parameters.h"

namespace covary {

/// "intIOR" -> "int_ior", "toWorld" -> "to_world": a capital after a lower-case letter starts a new word.
std::string snake_case(std::string_view name);

/// Converts one object of a file of version 0.x or 1.x to the names of version 3. Properties of the old renderer that
/// do not affect our images (gamma of the output file, …) are dropped with a warning.
void upgrade_object(ObjectDescription& object, Diagnostics& diagnostics);

}  // namespace covary
