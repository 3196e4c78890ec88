// SPDX-License-Identifier: Apache-2.0
// Descriptions of objects in the making, by the readers of formats that are not XML.
#pragma once

#include <memory>
#include <string>

#include "scene/parameters.h"

namespace covary {

using ObjectBuilder = std::shared_ptr<ObjectDescription>;
ObjectBuilder make_object(const std::string& kind, const std::string& type, const SourceLocation& where);
/// Transformations are kept as their 16 numbers say, which is all that a file can hold: its inverse is that of them.
void set_property(ObjectDescription& object, const std::string& name, Value value);

}  // namespace covary
