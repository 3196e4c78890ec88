// SPDX-License-Identifier: Apache-2.0
// normalmap: replaces the shading normal of a model by one stored in a texture.
//
// | name                   | type    | default  | meaning                                                        |
// |------------------------|---------|----------|----------------------------------------------------------------|
// | normalmap              | texture | required | (n + 1) / 2 of the normal n in the shading frame, a raw bitmap |
// | (nested)               | bsdf    |          | exactly one model                                              |
// | flip_invalid_normals   | bool    | true     | keep the normal on the side of the camera (perturbed.h)        |
// | use_shadowing_function | bool    | true     | soften the shadow at grazing light (perturbed.h)               |
// | along_dv               | bool    | false    | our own: the y axis of stored normals follows dp/dv            |
//
// The x axis of the stored normals follows dp/du. Their y axis is normal x dp/du, which points against dp/dv where the
// texture is mirrored; with `along_dv` it does not, as in glTF.
#include "bsdfs/inputs.h"
#include "bsdfs/perturbed.h"
#include "bsdfs/registry.h"

namespace covary {
namespace {

class NormalMap final : public PerturbingBsdf {
 public:
  NormalMap(TexturePtr normals, BsdfPtr nested, Parameters& p)
      : PerturbingBsdf(std::move(nested), p), normals_(std::move(normals)), along_dv_(p.get_bool("along_dv", false)) {}

  const BsdfClosure* bind(const SurfaceHit& hit, bool wo_front, TransportMode mode, Arena& arena) const override {
    const PerturbedModel model = PerturbedModel::bind(*nested_, flip_invalid_, hit, wo_front, mode, arena);
    const Spectrum c = normals_->eval(hit);
    const float side = along_dv_ && dot(cross(hit.frame.n, hit.dp_du), hit.dp_dv) < 0 ? -1.0f : 1.0f;
    const Vec3 stored{2 * c.r - 1, side * (2 * c.g - 1), 2 * c.b - 1};
    const float l = length(stored);
    if (!(l > 0)) return model.here;
    // From the frame along dp/du to the local shading frame; identity if they coincide.
    const Frame uv = Frame::from_tangent({0, 0, 1}, hit.frame.to_local(hit.dp_du));
    return make_perturbed(model, {uv.to_world(stored * (1 / l)), uv.s, flip_invalid_, shadow_terminator_}, mode, arena);
  }

 private:
  TexturePtr normals_;
  bool along_dv_;
};

}  // namespace

std::shared_ptr<Bsdf> make_normalmap(Parameters& parameters) {
  const TexturePtr normals = parameters.find_texture("normalmap");
  if (!normals && !parameters.has("normalmap")) parameters.error("the texture 'normalmap' is missing");
  const std::vector<BsdfPtr> nested = get_nested_bsdfs(parameters, 1, 1);
  auto made = std::make_shared<NormalMap>(normals, nested.empty() ? nullptr : nested[0], parameters);
  return nested.empty() || !normals ? nullptr : made;
}

}  // namespace covary
