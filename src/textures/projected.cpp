// SPDX-License-Identifier: Apache-2.0
// `projected`: a texture at coordinates that depend on the position in space, pbrt's texture mappings, or that another
// texture gives.
//
// | parameter | type      | default   | meaning                                                                   |
// |-----------|-----------|-----------|---------------------------------------------------------------------------|
// | (nested)  | texture   | required  | the texture                                                               |
// | mapping   | string    | planar    | (s, t) is (p · v1, p · v2) + offset; `cylindrical`: ((π + φ) / 2π, z);    |
// |           |           |           | `spherical`: (θ / π, φ / 2π) of the direction from the origin             |
// | v1, v2    | vector    | x, y      | `planar`                                                                  |
// | offset    | vector    | 0         | `planar`; z has no meaning                                                |
// | to_world  | transform | identity  | from the texture's space, in which p is measured                          |
// | coordinates | texture |           | instead of a mapping: (s, t) is red and green of this texture             |
#include <cmath>

#include "textures/gradient.h"
#include "textures/registry.h"

namespace covary {
namespace {

enum class Mapping { kPlanar, kCylindrical, kSpherical, kTexture };

class Projected final : public Texture {
 public:
  Projected(TexturePtr nested, TexturePtr coordinates, Parameters& p)
      : nested_(std::move(nested)),
        to_texture_(p.get_transform("to_world").inverse()),
        v1_(p.get_vec3("v1", {1, 0, 0})),
        v2_(p.get_vec3("v2", {0, 1, 0})),
        offset_(p.get_vec3("offset", {0, 0, 0})),
        coordinates_(std::move(coordinates)) {
    const std::string mapping = p.get_choice("mapping", "planar", {"planar", "cylindrical", "spherical"});
    mapping_ = mapping == "planar"        ? Mapping::kPlanar
               : mapping == "cylindrical" ? Mapping::kCylindrical
                                          : Mapping::kSpherical;
    if (coordinates_) mapping_ = Mapping::kTexture;
  }
  Spectrum eval(const SurfaceHit& hit) const override { return nested_->eval(mapped(hit)); }
  float eval_1(const SurfaceHit& hit) const override { return nested_->eval_1(mapped(hit)); }
  Vec2 grad_1(const SurfaceHit& hit) const override { return difference_gradient(*this, hit); }
  bool is_constant() const override { return nested_->is_constant(); }
  float mean() const override { return nested_->mean(); }

 private:
  SurfaceHit mapped(const SurfaceHit& hit) const {
    SurfaceHit result = hit;
    if (mapping_ == Mapping::kTexture) {
      const Spectrum at = coordinates_->eval(hit);
      result.uv = {at.r, at.g};
      return result;
    }
    const Vec3 p = to_texture_.point(hit.p);
    if (mapping_ == Mapping::kPlanar) {
      result.uv = {dot(p, v1_) + offset_.x, dot(p, v2_) + offset_.y};
    } else if (mapping_ == Mapping::kCylindrical) {
      result.uv = {(kPi + std::atan2(p.y, p.x)) / kTwoPi, p.z};
    } else {
      const float phi = std::atan2(p.y, p.x), theta = std::atan2(std::sqrt(p.x * p.x + p.y * p.y), p.z);
      result.uv = {theta / kPi, (phi < 0 ? phi + kTwoPi : phi) / kTwoPi};
    }
    return result;
  }

  TexturePtr nested_;
  Transform to_texture_;
  Vec3 v1_, v2_, offset_;
  TexturePtr coordinates_;
  Mapping mapping_;
};

}  // namespace

std::shared_ptr<Texture> make_projected(Parameters& p) {
  const TexturePtr coordinates = p.find_texture("coordinates");
  const auto nested = p.children<Texture>("texture");
  if (nested.size() == 1) return std::make_shared<Projected>(nested.front(), coordinates, p);
  p.error("needs exactly one nested texture, but has " + std::to_string(nested.size()));
  return nullptr;
}

}  // namespace covary
