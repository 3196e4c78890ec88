// SPDX-License-Identifier: Apache-2.0
#include "io/mesh_attributes.h"

#include <algorithm>

#include "formats/object_graph.h"

namespace covary {

std::vector<std::string> wanted_attributes(const ObjectDescription& shape) {
  std::vector<std::string> names;
  visit_properties(shape, [&](const ObjectDescription& object, const Property& property) {
    if (object.kind != "texture" || object.type != "mesh_attribute" || property.name != "name") return;
    const std::string* name = std::get_if<std::string>(&property.value);
    if (name && std::find(names.begin(), names.end(), *name) == names.end()) names.push_back(*name);
  });
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace covary
