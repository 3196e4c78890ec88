// SPDX-License-Identifier: Apache-2.0
// Work that can be done in parallel while a scene loads: everything that reads files or computes tables, which are
// textures and emitters without nested objects, and the surfaces of shapes.
#pragma once

#include <memory>
#include <string>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "emitters/area.h"
#include "formats/file_resolver.h"
#include "io/object_factory.h"
#include "scene/parameters.h"
#include "scene/scene.h"
#include "scene/shape.h"

namespace covary {

/// A shape while it is made: its surface in parallel, then material and light.
struct ShapeJob {
  ShapeJob(ObjectPtr object, MadeObjects& made, FileResolver& files)
      : description(std::move(object)),
        factory(made, files, diagnostics),
        parameters(*description, factory, diagnostics) {}
  ShapeJob(const ShapeJob&) = delete;
  ShapeJob& operator=(const ShapeJob&) = delete;

  ObjectPtr description;
  Diagnostics diagnostics;
  SceneFactory factory;
  Parameters parameters;
  ShapePtr shape;  ///< null where it could not be made
  bool in_group = false;
  KeyedTransformPtr to_world;        ///< of a shape that moves; `shape` is in its own space
  const AreaLight* light = nullptr;  ///< of a shape in a group, or that moves: each copy becomes a light of its own
  bool asked_everything = false;     ///< else what is left over says nothing about unknown parameters
};

class SceneJobs {
 public:
  SceneJobs(MadeObjects& made, FileResolver& files) : made_(made), files_(files) {}

  /// The jobs of a scene. Equal textures are made once.
  void collect(const ObjectDescription& scene);

  /// Makes all of them. Problems of textures and emitters go to `diagnostics`, those of shapes stay with their jobs.
  void run(Diagnostics& diagnostics);

  /// The job of a shape that has a surface of its own; null for other objects.
  ShapeJob* shape(const ObjectDescription* description) const;

  /// In the order of the file.
  void append_diagnostics_of_shapes(Diagnostics& diagnostics) const;

 private:
  struct LeafJob {
    std::vector<ObjectPtr> descriptions;  // equal ones
    Diagnostics diagnostics;
  };
  void collect_leaves(const ObjectPtr& object, std::unordered_set<const ObjectDescription*>& seen);
  void add_shape(const ObjectPtr& object, bool in_group);

  MadeObjects& made_;
  FileResolver& files_;
  std::vector<std::unique_ptr<LeafJob>> leaves_;
  std::unordered_map<std::string, LeafJob*> leaves_by_key_;
  std::vector<std::unique_ptr<ShapeJob>> shapes_;
  std::unordered_map<const ObjectDescription*, ShapeJob*> shapes_by_description_;
};

// Memory of shapes, computed before it is allocated (core/memory_limit.h): a few lines of a scene can place a mesh
// thousands of times.

/// Approximate bytes of the shape's arrays.
double array_bytes(const Shape& shape);

/// Approximate bytes that a scene needs for the shape besides these: the BVH, and sampling tables of emitters.
double table_bytes(const Shape& shape, bool emits);

/// Throws Error(kInput) if the tables of all shapes need too much. `file`: of the scene.
void require_table_memory(const std::string& file, const SceneParts& parts);

}  // namespace covary
