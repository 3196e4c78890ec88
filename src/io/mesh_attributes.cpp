// SPDX-License-Identifier: Apache-2.0
#include "io/mesh_attributes.h"

#include <algorithm>
#include <unordered_set>

namespace covary {

std::vector<std::string> wanted_attributes(const ObjectDescription& shape) {
  std::vector<std::string> names;
  std::unordered_set<const ObjectDescription*> seen;
  std::vector<const ObjectDescription*> open = {&shape};
  while (!open.empty()) {
    const ObjectDescription* object = open.back();
    open.pop_back();
    for (const Property& property : object->properties) {
      if (const ObjectPtr* child = std::get_if<ObjectPtr>(&property.value)) {
        if (*child && seen.insert(child->get()).second) open.push_back(child->get());
      } else if (object->kind == "texture" && object->type == "mesh_attribute" && property.name == "name") {
        const std::string* name = std::get_if<std::string>(&property.value);
        if (name && std::find(names.begin(), names.end(), *name) == names.end()) names.push_back(*name);
      }
    }
  }
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace covary
