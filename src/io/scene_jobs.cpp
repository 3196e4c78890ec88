// SPDX-License-Identifier: Apache-2.0
#include "io/scene_jobs.h"

#include <fmt/format.h>
#include <algorithm>
#include <set>

#include "core/memory_limit.h"
#include "core/number_text.h"
#include "core/parallel.h"
#include "io/object_factory.h"
#include "io/shapes.h"
#include "scene/mesh.h"

namespace covary {
namespace {

/// Whether it has no nested objects.
bool is_leaf(const ObjectDescription& object) {
  return std::none_of(object.properties.begin(), object.properties.end(),
                      [](const Property& p) { return std::holds_alternative<ObjectPtr>(p.value); });
}

/// False for shapes that only place others.
bool has_surface(const ObjectDescription& shape) { return shape.type != "instance" && shape.type != "shapegroup"; }

void make_surface(ShapeJob& job) {
  const Plugin<Shape>* plugin =
      find_plugin(shape_plugins(), *job.description, job.diagnostics, {"instance", "shapegroup"});
  if (!plugin) return;
  try {
    job.shape = plugin->make(job.parameters);
    job.asked_everything = true;
  } catch (const Error& error) {
    if (error.code() == ErrorCode::kInternal) throw;
    job.parameters.error(error.what());
  }
}

}  // namespace

void SceneJobs::collect(const ObjectDescription& scene) {
  std::unordered_set<const ObjectDescription*> seen;
  for (const Property& property : scene.properties)
    if (const ObjectPtr* object = std::get_if<ObjectPtr>(&property.value)) collect_leaves(*object, seen);
  for (const Property& property : scene.properties) {
    const ObjectPtr* object = std::get_if<ObjectPtr>(&property.value);
    if (!object || !*object || (*object)->kind != "shape") continue;
    if ((*object)->type == "shapegroup") {
      for (const Property& member : (*object)->properties)
        if (const ObjectPtr* shape = std::get_if<ObjectPtr>(&member.value); shape && *shape && has_surface(**shape))
          add_shape(*shape, true);
    } else if (has_surface(**object)) {
      add_shape(*object, false);
    }
  }
}

void SceneJobs::collect_leaves(const ObjectPtr& object, std::unordered_set<const ObjectDescription*>& seen) {
  if (!object || !seen.insert(object.get()).second) return;
  if ((object->kind == "texture" || object->kind == "emitter") && is_leaf(*object)) {
    LeafJob*& same = leaves_by_key_[description_key(*object)];
    if (!same || object->kind != "texture") {
      leaves_.push_back(std::make_unique<LeafJob>(ignores_unknown_));
      same = leaves_.back().get();
    }
    same->descriptions.push_back(object);
  }
  for (const Property& property : object->properties)
    if (const ObjectPtr* child = std::get_if<ObjectPtr>(&property.value)) collect_leaves(*child, seen);
}

void SceneJobs::add_shape(const ObjectPtr& object, bool in_group) {
  if (object->kind != "shape" || shapes_by_description_.contains(object.get())) return;
  KeyedTransformPtr to_world;
  shapes_.push_back(
      std::make_unique<ShapeJob>(in_group ? object : in_own_space(object, to_world), made_, files_, ignores_unknown_));
  shapes_.back()->in_group = in_group;
  shapes_.back()->to_world = to_world;
  shapes_by_description_[object.get()] = shapes_.back().get();
}

void SceneJobs::run(Diagnostics& diagnostics) {
  // Textures first: one of them takes longer than many meshes.
  parallel_for(leaves_.size() + shapes_.size(), [&](size_t i) {
    if (i < leaves_.size()) {
      SceneFactory factory(made_, files_, leaves_[i]->diagnostics);
      const auto& same = leaves_[i]->descriptions;
      const auto object = factory.make(same[0]);
      for (size_t k = 1; k < same.size(); ++k) made_.add(same[k].get(), object);
    } else {
      make_surface(*shapes_[i - leaves_.size()]);
    }
  });
  for (const auto& leaf : leaves_) diagnostics.append(leaf->diagnostics);
}

void SceneJobs::make_shape(const ObjectPtr& object) {
  add_shape(object, false);
  make_surface(*shapes_.back());
}

ShapeJob* SceneJobs::shape(const ObjectDescription* description) const {
  const auto found = shapes_by_description_.find(description);
  return found == shapes_by_description_.end() ? nullptr : found->second;
}

void SceneJobs::append_diagnostics_of_shapes(Diagnostics& diagnostics) const {
  for (const auto& job : shapes_) diagnostics.append(job->diagnostics);
}

namespace {

constexpr double kOther = 500;                // a shape that is not a mesh, and the fixed part of one that is
constexpr double kTree = 90, kSampling = 84;  // per triangle, measured on grids of 44 thousand and 2 million

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

void DegenerateTriangles::see(const Shape& shape, const SourceLocation& where) {
  const auto* mesh = dynamic_cast<const TriangleMesh*>(&shape);
  if (!mesh || mesh->n_degenerate() == 0) return;
  if (n_ == 0) first_ = where;
  n_ += mesh->n_degenerate();
  ++n_meshes_;
}

void DegenerateTriangles::tell(Diagnostics& diagnostics) const {
  if (n_ > 0)
    diagnostics.warn({}, fmt::format("left out {} of zero area in {}, the first in {}", counted(n_, "triangle"),
                                     counted(n_meshes_, "mesh", "meshes"), first_.text()));
}

size_t n_instances_alike(const ObjectDescription& scene, const ObjectDescription& instance) {
  const auto group_of = [](const ObjectDescription& description) -> const ObjectDescription* {
    if (description.kind != "shape" || description.type != "instance") return nullptr;
    for (const Property& property : description.properties)
      if (const ObjectPtr* child = std::get_if<ObjectPtr>(&property.value))
        if (*child && (*child)->kind == "shape") return child->get();
    return nullptr;
  };
  const ObjectDescription* placed = group_of(instance);
  const auto n = std::count_if(scene.properties.begin(), scene.properties.end(), [&](const Property& p) {
    const ObjectPtr* other = std::get_if<ObjectPtr>(&p.value);
    return other && *other && group_of(**other) == placed;
  });
  return static_cast<size_t>(n);
}

bool has_delta_lights_and_surfaces(const SceneParts& parts) {
  const auto any = [](const std::vector<ShapePtr>& shapes) {
    return std::any_of(shapes.begin(), shapes.end(), [](const ShapePtr& shape) {
      return shape->bsdf() && shape->bsdf()->flags() & (kDeltaReflection | kDeltaTransmission);
    });
  };
  return std::any_of(parts.emitters.begin(), parts.emitters.end(), [](const auto& e) { return e->is_delta(); }) &&
         (any(parts.shapes) || std::any_of(parts.instances.begin(), parts.instances.end(),
                                           [&](const Instance& instance) { return any(instance.group->shapes); }));
}

}  // namespace covary
