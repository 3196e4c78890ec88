// SPDX-License-Identifier: Apache-2.0
#include "io/scene_memory.h"

#include <fmt/format.h>

#include <set>

#include "core/memory_limit.h"
#include "scene/mesh.h"

namespace covary {
namespace {

constexpr double kOther = 500;                // a shape that is no mesh, and the rest of one that is
constexpr double kTree = 90, kSampling = 84;  // per triangle, measured with grids of 44 thousand and 2 million

}  // namespace

double array_bytes(const Shape& shape) {
  const auto* mesh = dynamic_cast<const TriangleMesh*>(&shape);
  if (!mesh) return kOther;
  const double vertex = sizeof(TriangleMesh::Vertex) + (mesh->has_vertex_colour() ? sizeof(Spectrum) : 0);
  return kOther + static_cast<double>(mesh->vertices().size()) * vertex +
         static_cast<double>(mesh->triangles().size() * sizeof(mesh->triangles()[0]));
}

double table_bytes(const Shape& shape, bool emits) {
  return static_cast<double>(shape.n_primitives()) * (kTree + (emits ? kSampling : 0));
}

void require_table_memory(const std::string& file, const SceneParts& parts) {
  double bytes = 0;
  size_t n_primitives = 0;
  const auto add = [&](const Shape& shape) {
    bytes += table_bytes(shape, shape.emitter() != nullptr);
    n_primitives += shape.n_primitives();
  };
  for (const ShapePtr& shape : parts.shapes) add(*shape);
  std::set<const ShapeGroup*> groups;
  for (const Instance& instance : parts.instances)
    if (groups.insert(instance.group.get()).second)
      for (const ShapePtr& shape : instance.group->shapes) add(*shape);
  require_memory(file, fmt::format("tracing rays through {} triangles and other shapes", n_primitives), bytes);
}

}  // namespace covary
