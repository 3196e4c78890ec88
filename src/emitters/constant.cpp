// SPDX-License-Identifier: Apache-2.0
// `constant`: the same radiance from all directions.
//
// | parameter | type   | default | meaning  |
// |-----------|--------|---------|----------|
// | radiance  | colour | 1       | radiance |
#include "core/warp.h"
#include "emitters/registry.h"
#include "emitters/scene_sphere.h"

namespace covary {
namespace {

class ConstantLight final : public Emitter {
 public:
  explicit ConstantLight(Parameters& p) : radiance_(p.get_spectrum("radiance", Spectrum(1), SpectrumRole::kEmission)) {
    p.get_transform("to_world");  // ignored: nothing to rotate
  }

  std::shared_ptr<const Emitter> in_scene(const Bounds3& bounds) const override {
    auto placed = std::make_shared<ConstantLight>(*this);
    placed->scene_ = SceneSphere(bounds);
    return placed;
  }
  bool is_environment() const override { return true; }
  EnvironmentLight environment(const Vec3&) const override { return {radiance_, warp::sphere_pdf_solid_angle()}; }

  EmitterSample sample_towards(const Vec3&, Vec2 u, float) const override {
    EmitterSample sample;
    sample.wi = warp::square_to_sphere(u);
    sample.radiance = radiance_;
    sample.pdf_solid_angle = warp::sphere_pdf_solid_angle();
    return sample;
  }

  EmissionSample sample_emission(Vec2 u_position, Vec2 u_direction, float) const override {
    return scene_.emission(warp::square_to_sphere(u_direction), u_position, radiance_, warp::sphere_pdf_solid_angle());
  }

  EmissionPdf pdf_emission(const SurfaceHit&, const Vec3&) const override {
    return {1 / scene_.disk_area(), warp::sphere_pdf_solid_angle()};
  }

  Spectrum power() const override { return radiance_ * (4 * kPi * scene_.disk_area()); }

 private:
  Spectrum radiance_;
  SceneSphere scene_;
};

}  // namespace

std::shared_ptr<Emitter> make_constant(Parameters& parameters) { return std::make_shared<ConstantLight>(parameters); }

}  // namespace covary
