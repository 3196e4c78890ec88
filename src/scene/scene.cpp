// SPDX-License-Identifier: Apache-2.0
#include "scene/scene.h"

#include <utility>

#include "core/error.h"
#include "core/stopwatch.h"
#include "scene/mesh.h"
#include "scene/ray_tracer.h"

namespace covary {

Scene::Scene(SceneParts parts) : parts_(std::move(parts)) {
  const Stopwatch watch;
  COVARY_CHECK(parts_.camera, "a scene needs a camera");
  measure();
  tracer_ = std::make_unique<RayTracer>(parts_.shapes, parts_.instances, moves());
  if (moves()) movements_.assign(parts_.shapes.size() + parts_.instances.size(), -1);
  for (size_t i = 0; i < parts_.movements.size(); ++i) {
    const Movement& movement = parts_.movements[i];
    movements_[movement.index + (movement.shape_at ? 0 : parts_.shapes.size())] = static_cast<int>(i);
  }
  place_lights();
  build_seconds_ = watch.seconds();
}

void Scene::measure() {
  bounds_ = {};
  n_triangles_ = 0;
  for (const ShapePtr& shape : parts_.shapes) {
    COVARY_CHECK(shape->bsdf(), "every shape needs a BSDF");
    if (auto* mesh = dynamic_cast<TriangleMesh*>(shape.get()); mesh && mesh->emitter()) mesh->prepare_sampling();
    bounds_.extend(shape->bounds());
    n_triangles_ += dynamic_cast<const TriangleMesh*>(shape.get()) ? shape->n_primitives() : 0;
  }
  for (const Instance& instance : parts_.instances)
    for (const ShapePtr& shape : instance.group->shapes) {
      bounds_.extend(instance.to_world.bounds(shape->bounds()));
      n_triangles_ += dynamic_cast<const TriangleMesh*>(shape.get()) ? shape->n_primitives() : 0;
    }
  if (bounds_.empty()) bounds_ = {{-1, -1, -1}, {1, 1, 1}};  // lights at infinity still need a bounding sphere
}

void Scene::place_lights() {
  environment_ = nullptr;
  for (auto& emitter : parts_.emitters) {
    if (auto placed = emitter->in_scene(bounds_)) emitter = std::move(placed);
    if (emitter->is_environment()) {
      if (environment_) throw Error(ErrorCode::kInput, "a scene can have only one environment light");
      environment_ = emitter.get();
    }
  }
}

void Scene::move_to(double time) {
  bool changed = false;
  for (const Movement& movement : parts_.movements) {
    const Transform to_world = movement.to_world->at(time);
    if (to_world.matrix() == movement.to_world->at(time_).matrix()) continue;
    changed = true;
    if (!movement.shape_at) {
      parts_.instances[movement.index].to_world = to_world;
      tracer_->move_instance(movement.index, to_world);
      continue;
    }
    ShapePtr& shape = parts_.shapes[movement.index];
    const ShapePtr moved = movement.shape_at(to_world);
    tracer_->move_shape(movement.index, *moved);
    for (auto& emitter : parts_.emitters)
      if (emitter == shape->shared_emitter()) emitter = moved->shared_emitter();
    shape = moved;
  }
  time_ = time;
  if (!changed) return;
  measure();
  tracer_->commit();
  place_lights();
}

std::vector<Transform> Scene::displacements(double then) const {
  std::vector<Transform> maps;
  for (const Movement& movement : parts_.movements)
    maps.push_back(movement.to_world->at(then) * movement.to_world->at(time_).inverse());
  return maps;
}

Scene::~Scene() = default;
bool Scene::intersect(const Ray& ray, SurfaceHit& hit) const {
  RayHit found;
  tracer_->nearest({&ray, 1}, {&found, 1}, false);
  if (found.found()) resolve(ray, found, hit);
  return found.found();
}
void Scene::nearest(std::span<const Ray> rays, std::span<RayHit> hits, bool coherent) const {
  tracer_->nearest(rays, hits, coherent);
}
void Scene::resolve(const Ray& ray, const RayHit& found, SurfaceHit& hit) const { tracer_->resolve(ray, found, hit); }
bool Scene::occluded(const Ray& ray) const {
  uint8_t blocked = 0;
  tracer_->occluded({&ray, 1}, {&blocked, 1});
  return blocked;
}
void Scene::occluded(std::span<const Ray> rays, std::span<uint8_t> blocked) const { tracer_->occluded(rays, blocked); }

}  // namespace covary
