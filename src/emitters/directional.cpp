// SPDX-License-Identifier: Apache-2.0
// `directional`: parallel light from a source at infinity.
//
// | parameter  | type      | default  | meaning                                                        |
// |------------|-----------|----------|----------------------------------------------------------------|
// | irradiance | colour    | 1        | on a surface that faces the light                              |
// | direction  | vector    | (0,0,1)  | the way the light travels; not together with to_world          |
// | to_world   | transform | identity | the light travels along the image of the z axis                |
#include "emitters/registry.h"
#include "emitters/scene_sphere.h"

namespace covary {
namespace {

class DirectionalLight final : public Emitter {
 public:
  explicit DirectionalLight(Parameters& p)
      : direction_(p.get_vec3("direction", p.get_transform("to_world").vector({0, 0, 1}))),
        irradiance_(p.get_spectrum("irradiance", Spectrum(1), SpectrumRole::kEmission)) {
    if (p.has("direction") && p.has("to_world")) p.error_at("direction", "cannot be combined with 'to_world'");
    if (!(length_squared(direction_) > 0)) p.error_at("direction", "has length zero");
    direction_ = normalize(direction_);
  }

  std::shared_ptr<const Emitter> in_scene(const Bounds3& bounds) const override {
    auto placed = std::make_shared<DirectionalLight>(*this);
    placed->scene_ = SceneSphere(bounds);
    return placed;
  }
  bool is_delta_direction() const override { return true; }

  EmitterSample sample_towards(const Vec3&, Vec2, float) const override {
    EmitterSample sample;
    sample.wi = -direction_;
    sample.radiance = irradiance_;
    sample.pdf_solid_angle = 1;
    sample.is_delta = true;
    return sample;
  }

  EmissionSample sample_emission(Vec2 u_position, Vec2, float) const override {
    EmissionSample sample = scene_.emission(direction_, u_position, irradiance_, 1);
    sample.delta_direction = true;
    return sample;
  }

  EmissionPdf pdf_emission(const SurfaceHit&, const Vec3&) const override { return {1 / scene_.disk_area(), 1}; }

  Spectrum power() const override { return irradiance_ * scene_.disk_area(); }

 private:
  Vec3 direction_;
  Spectrum irradiance_;
  SceneSphere scene_;
};

}  // namespace

std::shared_ptr<Emitter> make_directional(Parameters& parameters) {
  return std::make_shared<DirectionalLight>(parameters);
}

}  // namespace covary
