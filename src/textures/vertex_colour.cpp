// SPDX-License-Identifier: Apache-2.0
// Attributes stored at the vertices of a mesh and interpolated over its triangles, or stored per triangle; white on
// shapes without the attribute.
//
// `vertexcolor` (Mitsuba 0.x) has no parameters. `mesh_attribute` (Mitsuba 3):
//
// | parameter | type   | default  | meaning                                                       |
// |-----------|--------|----------|---------------------------------------------------------------|
// | name      | string | required | `vertex_…` or `face_…`, by the names of the file's properties |
// | scale     | float  | 1        | factor                                                        |
#include <string>

#include "scene/shape.h"
#include "textures/registry.h"

namespace covary {
namespace {

class MeshAttributeTexture final : public Texture {
 public:
  MeshAttributeTexture(std::string name, float scale) : name_(std::move(name)), scale_(scale) {}
  Spectrum eval(const SurfaceHit& hit) const override { return hit.shape->attribute(name_, hit) * scale_; }
  float eval_1(const SurfaceHit& hit) const override { return luminance(eval(hit)); }
  Vec2 grad_1(const SurfaceHit&) const override { return {0, 0}; }
  /// Not known, because one texture serves many meshes: the middle of [0, 1].
  float mean() const override { return 0.5f * scale_; }

 private:
  std::string name_;
  float scale_;
};

}  // namespace

std::shared_ptr<Texture> make_vertexcolor(Parameters&) {
  return std::make_shared<MeshAttributeTexture>("vertex_color", 1.0f);
}

std::shared_ptr<Texture> make_mesh_attribute(Parameters& parameters) {
  const std::string name = parameters.require_string("name");
  const float scale = parameters.get_float("scale", 1, 0);
  if (name.empty()) return nullptr;  // already reported
  if (!name.starts_with("vertex_") && !name.starts_with("face_")) {
    parameters.error_at("name", "is '" + name + "'; expected a name that begins with 'vertex_' or 'face_'");
    return nullptr;
  }
  return std::make_shared<MeshAttributeTexture>(name, scale);
}

}  // namespace covary
