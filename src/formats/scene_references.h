// SPDX-License-Identifier: Apache-2.0
// References between the objects of a scene file, resolved once all of it is read: <ref> and <alias> become pointers,
// and cycles and excessive expansion, which would make later steps endless or very long, are found and cut.
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

/// Replaces descriptions of the kind `ref` by the objects that they name; unknown ones are errors and become null.
void resolve_references(const SceneObjects& objects, ObjectIds ids, const std::vector<SceneAlias>& aliases,
                        Diagnostics& diagnostics);

/// Records an error for every cyclic reference, and cuts it. Returns all objects, each after everything it holds.
std::vector<ObjectDescription*> break_cycles(const SceneObjects& objects, Diagnostics& diagnostics);

/// Finds objects that hold too many others, or more than `max_nesting` nested ones, when every reference is followed.
class ExpansionLimit {
 public:
  ExpansionLimit(size_t max_nesting, Diagnostics& diagnostics) : max_nesting_(max_nesting), diagnostics_(diagnostics) {}
  /// False after recording an error; the object then counts as empty, because its user leaves it out. The objects it
  /// holds were added before, or hold few themselves.
  bool add(const ObjectDescription& object);

 private:
  struct Expanded {
    size_t count = 1, depth = 1;
  };
  size_t max_nesting_;
  Diagnostics& diagnostics_;
  std::unordered_map<const ObjectDescription*, Expanded> expanded_;
};

/// Records an error for objects that hold too many others, or more than `max_nesting` nested ones, when every reference
/// is followed, and removes them. `objects`: each after everything it holds.
void limit_expansion(const std::vector<ObjectDescription*>& objects, size_t max_nesting, Diagnostics& diagnostics);

}  // namespace covary
