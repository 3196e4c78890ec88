// SPDX-License-Identifier: Apache-2.0
// `checkerboard`: two by two squares per unit of (u, v), after Mitsuba 3's plugin of the same name.
//
// | parameter | type             | default  | meaning                                        |
// |-----------|------------------|----------|------------------------------------------------|
// | color0    | colour, texture  | 0.4      | squares on the diagonal, (0, 0) among them     |
// | color1    | colour, texture  | 0.2      | the other squares                              |
// | to_uv     | transform        | identity | from surface parameters to texture coordinates |
// | dimension | integer          | 2        | or 3: unit cubes in space, color0 at the origin |
// | to_world  | transform        | identity | from the space of the cubes                    |
//
// Difference from Mitsuba 3.9: one-channel lookups (opacity, roughness, …) use the same squares as colour lookups;
// there, color0 and color1 are swapped.
#include "textures/registry.h"
#include "textures/uv_transform.h"

namespace covary {
namespace {

class Checkerboard : public Texture {
 public:
  Checkerboard(TexturePtr color0, TexturePtr color1, const UvTransform& to_uv)
      : color0_(std::move(color0)), color1_(std::move(color1)), to_uv_(to_uv) {}

  Spectrum eval(const SurfaceHit& hit) const override { return at(hit).eval(hit); }
  float eval_1(const SurfaceHit& hit) const override { return at(hit).eval_1(hit); }
  /// Gradient of the square's own texture; edges between squares contribute none.
  Vec2 grad_1(const SurfaceHit& hit) const override { return at(hit).grad_1(hit); }
  float mean() const override { return 0.5f * (color0_->mean() + color1_->mean()); }

 protected:
  virtual const Texture& at(const SurfaceHit& hit) const {
    const Vec2 st = to_uv_.apply(hit.uv);
    const bool right = st.x - std::floor(st.x) > 0.5f, lower = st.y - std::floor(st.y) > 0.5f;
    return right == lower ? *color0_ : *color1_;
  }

  TexturePtr color0_, color1_;
  UvTransform to_uv_;
};

class Cubes final : public Checkerboard {
 public:
  Cubes(TexturePtr color0, TexturePtr color1, const Transform& to_world)
      : Checkerboard(std::move(color0), std::move(color1), {}), to_cubes_(to_world.inverse()) {}

 private:
  const Texture& at(const SurfaceHit& hit) const override {
    const Vec3 p = to_cubes_.point(hit.p);
    const float sum = std::floor(p.x) + std::floor(p.y) + std::floor(p.z);
    return sum - 2 * std::floor(sum / 2) == 0 ? *color0_ : *color1_;
  }
  Transform to_cubes_;
};

}  // namespace

std::shared_ptr<Texture> make_checkerboard(Parameters& parameters) {
  TexturePtr color0 = parameters.get_texture("color0", Spectrum(0.4f), SpectrumRole::kEmission);
  TexturePtr color1 = parameters.get_texture("color1", Spectrum(0.2f), SpectrumRole::kEmission);
  const UvTransform to_uv(parameters.get_transform("to_uv"));
  const Transform to_world = parameters.get_transform("to_world");
  if (parameters.get_int("dimension", 2, 2, 3) == 3)
    return std::make_shared<Cubes>(std::move(color0), std::move(color1), to_world);
  return std::make_shared<Checkerboard>(std::move(color0), std::move(color1), to_uv);
}

}  // namespace covary
