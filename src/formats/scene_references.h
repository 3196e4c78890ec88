// SPDX-License-Identifier: Apache-2.0
// References between the objects of a scene file, once all of it is read: <ref> and <alias> become pointers, and
// whatever would make later steps go on for ever, or for very long, is found and cut.
#pragma once

#include <memory>
#include <string>
#include <unordered_map>
#include <vector>

#include "scene/parameters.h"

namespace covary {

/// All objects of a scene, in the order of the file.
using SceneObjects = std::vector<std::shared_ptr<ObjectDescription>>;
using ObjectIds = std::unordered_map<std::string, std::shared_ptr<ObjectDescription>>;

/// <alias id="…" as="…"/>
struct SceneAlias {
  std::string id, as;
  SourceLocation where;
};

/// Puts the objects that they name in the place of descriptions of the kind `ref`, or nothing for unknown ones, which
/// are errors.
void resolve_references(const SceneObjects& objects, ObjectIds ids, const std::vector<SceneAlias>& aliases,
                        Diagnostics& diagnostics);

/// Records an error for every reference that leads back to an object it is part of, and cuts it. Returns all objects,
/// each after everything it holds.
std::vector<ObjectDescription*> break_cycles(const SceneObjects& objects, Diagnostics& diagnostics);

/// Finds objects that hold too many others, or more than `max_nesting` inside each other, when every reference is
/// followed, one after the other.
class ExpansionLimit {
 public:
  ExpansionLimit(size_t max_nesting, Diagnostics& diagnostics) : max_nesting_(max_nesting), diagnostics_(diagnostics) {}
  /// False after recording an error; the object then counts as one that holds nothing, as its user leaves it out. What
  /// it holds was added before, or holds few itself.
  bool add(const ObjectDescription& object);

 private:
  struct Expanded {
    size_t count = 1, depth = 1;
  };
  size_t max_nesting_;
  Diagnostics& diagnostics_;
  std::unordered_map<const ObjectDescription*, Expanded> expanded_;
};

/// Records an error for objects that hold too many others, or more than `max_nesting` inside each other, when every
/// reference is followed, and takes these out. `objects`: each after everything it holds.
void limit_expansion(const std::vector<ObjectDescription*>& objects, size_t max_nesting, Diagnostics& diagnostics);

}  // namespace covary
