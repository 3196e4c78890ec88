// SPDX-License-Identifier: Apache-2.0
// References between the objects of a scene file, resolved after all of it is read: <ref> and <alias> become pointers;
// cycles and excessive expansion, which would make later steps endless or very slow, are detected and cut.
#pragma once

#include <memory>
#include <string>
#include <unordered_map>
#include <vector>

#include "scene/parameters.h"

namespace covary {

/// All objects of a scene, in file order.
using SceneObjects = std::vector<std::shared_ptr<ObjectDescription>>;
using ObjectIds = std::unordered_map<std::string, std::shared_ptr<ObjectDescription>>;

/// <alias id="…" as="…"/>
struct SceneAlias {
  std::string id, as;
  SourceLocation where;
};

/// Replaces descriptions of kind `ref` by the objects they name; unknown names are errors and become null.
void resolve_references(const SceneObjects& objects, ObjectIds ids, const std::vector<SceneAlias>& aliases,
                        Diagnostics& diagnostics);

/// Records an error for every cyclic reference and cuts it. Returns all objects in topological order, each after what
/// it holds.
std::vector<ObjectDescription*> break_cycles(const SceneObjects& objects, Diagnostics& diagnostics);

/// Detects objects that hold too many others, or more than `max_nesting` levels, with every reference expanded.
class ExpansionLimit {
 public:
  ExpansionLimit(size_t max_nesting, Diagnostics& diagnostics) : max_nesting_(max_nesting), diagnostics_(diagnostics) {}
  /// False after recording an error; the object then counts as empty, because its user drops it. Objects that it holds
  /// must have been added before, or hold few themselves.
  bool add(const ObjectDescription& object);

 private:
  struct Expanded {
    size_t count = 1, depth = 1;
  };
  size_t max_nesting_;
  Diagnostics& diagnostics_;
  std::unordered_map<const ObjectDescription*, Expanded> expanded_;
};

/// Records an error for objects that hold too many others, or more than `max_nesting` levels, with every reference
/// expanded, and removes them. `objects`: each after everything it holds.
void limit_expansion(const std::vector<ObjectDescription*>& objects, size_t max_nesting, Diagnostics& diagnostics);

}  // namespace covary
