// SPDX-License-Identifier: Apache-2.0
// Parallel work while a scene loads: everything that reads files or computes tables, that is textures and emitters
// without nested objects, and the surfaces of shapes.
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

/// A shape under construction: its surface in parallel, then material and light.
struct ShapeJob {
  ShapeJob(ObjectPtr object, MadeObjects& made, FileResolver& files, bool ignores_unknown)
      : description(std::move(object)),
        diagnostics(ignores_unknown),
        factory(made, files, diagnostics),
        parameters(*description, factory, diagnostics) {}
  ShapeJob(const ShapeJob&) = delete;
  ShapeJob& operator=(const ShapeJob&) = delete;

  ObjectPtr description;
  Diagnostics diagnostics;
  SceneFactory factory;
  Parameters parameters;
  ShapePtr shape;  ///< null if it could not be created
  bool in_group = false;
  KeyedTransformPtr to_world;        ///< of a moving shape; `shape` is in object space
  const AreaLight* light = nullptr;  ///< of a shape in a group or that moves: each copy becomes its own light
  bool asked_everything = false;     ///< otherwise unused parameters prove nothing
};

class SceneJobs {
 public:
  /// `ignores_unknown`: of their diagnostics.
  SceneJobs(MadeObjects& made, FileResolver& files, bool ignores_unknown)
      : made_(made), files_(files), ignores_unknown_(ignores_unknown) {}

  /// Collects the jobs of a scene. Equal textures are created once.
  void collect(const ObjectDescription& scene);

  /// Runs all jobs. Problems of textures and emitters go to `diagnostics`; those of shapes stay with their jobs.
  void run(Diagnostics& diagnostics);

  /// Makes a further shape after run().
  void make_shape(const ObjectPtr& object);

  /// The job of a shape that has its own surface; null for other objects.
  ShapeJob* shape(const ObjectDescription* description) const;

  /// In file order.
  void append_diagnostics_of_shapes(Diagnostics& diagnostics) const;

 private:
  struct LeafJob {
    explicit LeafJob(bool ignores_unknown) : diagnostics(ignores_unknown) {}
    std::vector<ObjectPtr> descriptions;  // with equal content
    Diagnostics diagnostics;
  };
  void collect_leaves(const ObjectPtr& object, std::unordered_set<const ObjectDescription*>& seen);
  void add_shape(const ObjectPtr& object, bool in_group);

  MadeObjects& made_;
  FileResolver& files_;
  bool ignores_unknown_;
  std::vector<std::unique_ptr<LeafJob>> leaves_;
  std::unordered_map<std::string, LeafJob*> leaves_by_key_;
  std::vector<std::unique_ptr<ShapeJob>> shapes_;
  std::unordered_map<const ObjectDescription*, ShapeJob*> shapes_by_description_;
};

// Memory of shapes, estimated before it is allocated (core/memory_limit.h): a few lines in a scene can place a mesh
// thousands of times.

/// Approximate size of the shape's arrays in bytes.
double array_bytes(const Shape& shape);

/// Approximate bytes that a scene needs for the shape in addition: the BVH, and sampling tables of emitters.
double table_bytes(const Shape& shape, bool emits);

/// Throws Error(kInput) if the tables of all shapes need too much memory. `file`: the scene's file, for the message.
void require_table_memory(const std::string& file, const SceneParts& parts);

/// Counts triangles of zero area, which meshes leave out.
class DegenerateTriangles {
 public:
  void see(const Shape& shape, const SourceLocation& where);
  /// A warning, if there are any.
  void tell(Diagnostics& diagnostics) const;

 private:
  size_t n_ = 0, n_meshes_ = 0;
  SourceLocation first_;
};

/// How many instances of the scene place the same group as this one.
size_t n_instances_alike(const ObjectDescription& scene, const ObjectDescription& instance);

/// LoadedScene::has_delta_lights_and_surfaces
bool has_delta_lights_and_surfaces(const SceneParts& parts);

}  // namespace covary
