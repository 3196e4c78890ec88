// SPDX-License-Identifier: Apache-2.0
// bumpmap: tilts the shading normal of a model as if the surface were displaced along its normal.
//
// | name                   | type    | default | meaning                                                            |
// |------------------------|---------|---------|--------------------------------------------------------------------|
// | (nested)               | texture |         | displacement, exactly one texture of any name                      |
// | (nested)               | bsdf    |         | exactly one model                                                  |
// | scale                  | number  | 1       | factor on the displacement                                         |
// | flip_invalid_normals   | bool    | true    | keep the tilted normal on the side of the camera (perturbed.h)     |
// | use_shadowing_function | bool    | true    | soften the shadow at grazing light (perturbed.h)                   |
//
// With displacement h(u, v) the tangents become dp/du + n dh/du and dp/dv + n dh/dv (Blinn 1978, "Simulation of
// Wrinkled Surfaces"; the change of the normal along the surface is neglected).
#include <fmt/format.h>

#include "bsdfs/inputs.h"
#include "bsdfs/perturbed.h"
#include "bsdfs/registry.h"

namespace covary {
namespace {

class BumpMap final : public PerturbingBsdf {
 public:
  BumpMap(TexturePtr displacement, BsdfPtr nested, Parameters& p)
      : PerturbingBsdf(std::move(nested), p), displacement_(std::move(displacement)), scale_(p.get_float("scale", 1)) {}

  const BsdfClosure* bind(const SurfaceHit& hit, bool wo_front, TransportMode mode, Arena& arena) const override {
    const PerturbedModel model = PerturbedModel::bind(*nested_, flip_invalid_, hit, wo_front, mode, arena);
    const Vec2 gradient = displacement_->grad_1(hit) * scale_;
    const Vec3 tangent = hit.frame.to_local(hit.dp_du), bitangent = hit.frame.to_local(hit.dp_dv);
    Vec3 n = cross({tangent.x, tangent.y, gradient.x}, {bitangent.x, bitangent.y, gradient.y});
    const float l = length(n);
    if (!(l > 0 && std::isfinite(l))) return model.here;  // a surface without (u, v) cannot be displaced
    n *= 1 / l;
    if (dot(hit.frame.to_local(hit.ng), n) < 0) n = -n;
    return make_perturbed(model, {n, tangent, flip_invalid_, shadow_terminator_}, mode, arena);
  }

 private:
  TexturePtr displacement_;
  float scale_;
};

}  // namespace

std::shared_ptr<Bsdf> make_bumpmap(Parameters& parameters) {
  size_t n_textures = 0;
  for (const Property& property : parameters.object().properties)
    if (const ObjectPtr* object = std::get_if<ObjectPtr>(&property.value))
      if (*object && (*object)->kind == "texture") ++n_textures;
  const std::vector<TexturePtr> textures = parameters.children<Texture>("texture");
  const std::vector<BsdfPtr> nested = get_nested_bsdfs(parameters, 1, 1);
  if (n_textures != 1) parameters.error(fmt::format("has {} nested textures; it takes exactly 1", n_textures));
  auto made = std::make_shared<BumpMap>(textures.empty() ? nullptr : textures[0], nested.empty() ? nullptr : nested[0],
                                        parameters);
  return n_textures != 1 || textures.empty() || nested.empty() ? nullptr : made;
}

}  // namespace covary
