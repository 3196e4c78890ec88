// SPDX-License-Identifier: Apache-2.0
// Colours stored at the vertices of a mesh, interpolated over its triangles; white on shapes without such colours.
//
// `vertexcolor` (Mitsuba 0.x) has no parameters. `mesh_attribute` (Mitsuba 3):
//
// | parameter | type   | default  | meaning                                          |
// |-----------|--------|----------|--------------------------------------------------|
// | name      | string | required | only `vertex_color` is known                     |
// | scale     | float  | 1        | factor                                           |
#include "scene/shape.h"
#include "textures/registry.h"

namespace covary {
namespace {

class VertexColour final : public Texture {
 public:
  explicit VertexColour(float scale) : scale_(scale) {}
  Spectrum eval(const SurfaceHit& hit) const override { return hit.shape->vertex_colour(hit) * scale_; }
  float eval_1(const SurfaceHit& hit) const override { return luminance(eval(hit)); }
  Vec2 grad_1(const SurfaceHit&) const override { return {0, 0}; }
  /// Unknown here, since one texture serves many meshes: the middle of [0, 1].
  float mean() const override { return 0.5f * scale_; }

 private:
  float scale_;
};

}  // namespace

std::shared_ptr<Texture> make_vertex_colour(Parameters&) { return std::make_shared<VertexColour>(1.0f); }

std::shared_ptr<Texture> make_mesh_attribute(Parameters& parameters) {
  const std::string name = parameters.require_string("name");
  const float scale = parameters.get_float("scale", 1, 0);
  if (name.empty()) return nullptr;  // already reported
  if (name != "vertex_color") {
    parameters.error_at("name", "is '" + name + "'; the only mesh attribute known is 'vertex_color'");
    return nullptr;
  }
  return std::make_shared<VertexColour>(scale);
}

}  // namespace covary
