// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "scene/parameters.h"

namespace covary {

/// "intIOR" -> "int_ior", "toWorld" -> "to_world": an upper-case letter after a lower-case one starts a new word.
std::string snake_case(std::string_view name);

/// Converts an object of a version 0.x or 1.x file to version 3 names. Properties that do not affect our images (gamma
/// of the output file, …) are dropped with a warning.
void upgrade_object(ObjectDescription& object, Diagnostics& diagnostics);

/// Turns a bsdf 'mixturebsdf' of any number of models into nested ones of two, 'blendbsdf'; new ones are added to
/// `objects`.
void expand_mixture(ObjectDescription& object, std::vector<std::shared_ptr<ObjectDescription>>& objects,
                    Diagnostics& diagnostics);

}  // namespace covary
