// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "scene/parameters.h"

namespace covary {

/// The names that textures `mesh_attribute` of the shape's models and lights ask its mesh for.
std::vector<std::string> wanted_attributes(const ObjectDescription& shape);

}  // namespace covary
