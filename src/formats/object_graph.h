// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <unordered_set>
#include <vector>

#include "scene/parameters.h"

namespace covary {

/// Calls `visit(object, property)` for each property of `root` and of all objects that it holds or refers to, directly
/// or not, each object once.
template <typename Visit>
void visit_properties(const ObjectDescription& root, const Visit& visit) {
  std::unordered_set<const ObjectDescription*> seen;
  std::vector<const ObjectDescription*> open = {&root};
  while (!open.empty()) {
    const ObjectDescription* object = open.back();
    open.pop_back();
    for (const Property& property : object->properties) {
      visit(*object, property);
      const ObjectPtr* child = std::get_if<ObjectPtr>(&property.value);
      if (child && *child && seen.insert(child->get()).second) open.push_back(child->get());
    }
  }
}

}  // namespace covary
