// SPDX-License-Identifier: Apache-2.0
// Helpers for building object descriptions, for readers of formats other than XML.
#pragma once

#include <initializer_list>
#include <map>
#include <memory>
#include <string>
#include <unordered_set>
#include <utility>
#include <vector>

#include "scene/parameters.h"

namespace covary {

using ObjectBuilder = std::shared_ptr<ObjectDescription>;
ObjectBuilder make_object(const std::string& kind, const std::string& type, const SourceLocation& where,
                          std::initializer_list<std::pair<std::string, Value>> properties = {});
/// Transformations are normalised to their 16 numbers, as a file would store them; the inverse is computed from these.
void set_property(ObjectDescription& object, const std::string& name, Value value);

/// Calls `visit(object, property)` once for each property of `root` and of all objects that it holds or references,
/// directly or indirectly.
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

// Meshes embedded in a scene's own file become PLY files in memory: property `data` of a shape `ply`.

struct EmbeddedMesh {
  std::vector<double> positions, normals, uvs;  ///< three, three and two numbers per vertex; the last two may be empty
  std::vector<double> colours, alphas;  ///< three and one; may be empty; attributes vertex_color and vertex_alpha
  std::vector<double> tangents;         ///< four, the last one the side; may be empty
  std::map<std::string, std::vector<double>> pairs;  ///< two numbers per vertex: more attributes, vertex_NAME, by NAME
  std::vector<double> corners;                       ///< three indices per triangle, integers in range
};

/// The mesh as a binary PLY file.
std::string ply_text(const EmbeddedMesh& mesh);

}  // namespace covary
