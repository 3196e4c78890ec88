// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <unordered_set>

#include "formats/object_graph.h"

namespace covary {

/// The objects that another one than the scene holds or refers to: those written at the top of the scene's file for
/// this alone have no place in the scene itself.
inline std::unordered_set<const ObjectDescription*> held_objects(const ObjectDescription& scene) {
  std::unordered_set<const ObjectDescription*> held;
  visit_properties(scene, [&](const ObjectDescription& object, const Property& property) {
    const ObjectPtr* child = std::get_if<ObjectPtr>(&property.value);
    if (child && *child && &object != &scene) held.insert(child->get());
  });
  return held;
}

}  // namespace covary
