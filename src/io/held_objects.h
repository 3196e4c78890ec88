// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <unordered_set>
#include <vector>

#include "scene/parameters.h"

namespace covary {

/// The objects that another one than the scene holds or refers to: those written at the top of the scene's file for
/// this alone have no place in the scene itself.
inline std::unordered_set<const ObjectDescription*> held_objects(const ObjectDescription& scene) {
  std::unordered_set<const ObjectDescription*> held, seen;
  std::vector<const ObjectDescription*> open = {&scene};
  while (!open.empty()) {
    const ObjectDescription* object = open.back();
    open.pop_back();
    for (const Property& property : object->properties) {
      const ObjectPtr* child = std::get_if<ObjectPtr>(&property.value);
      if (!child || !*child) continue;
      if (object != &scene) held.insert(child->get());
      if (seen.insert(child->get()).second) open.push_back(child->get());
    }
  }
  return held;
}

}  // namespace covary
