// SPDX-License-Identifier: Apache-2.0
// `point`: light from one point, equally in all directions.
//
// | parameter | type      | default  | meaning                                      |
// |-----------|-----------|----------|----------------------------------------------|
// | intensity | colour    | 1        | power per unit solid angle                   |
// | position  | point     | (0,0,0)  | where it stands; not together with to_world  |
// | to_world  | transform | identity | the point is the image of the origin         |
#include "core/warp.h"
#include "emitters/point_source.h"
#include "emitters/registry.h"

namespace covary {
namespace {

class PointLight final : public Emitter {
 public:
  explicit PointLight(Parameters& p)
      : position_(p.get_vec3("position", p.get_transform("to_world").point({0, 0, 0}))),
        intensity_(p.get_spectrum("intensity", Spectrum(1), SpectrumRole::kEmission)) {
    if (p.has("position") && p.has("to_world")) p.error_at("position", "cannot be combined with 'to_world'");
  }

  bool is_delta_position() const override { return true; }

  EmitterSample sample_towards(const Vec3& reference, Vec2, float) const override {
    return sample_point(position_, reference, [&](const Vec3&) { return intensity_; });
  }

  EmissionSample sample_emission(Vec2, Vec2 u_direction, float) const override {
    return emit_from_point(position_, warp::square_to_sphere(u_direction), intensity_, warp::sphere_pdf_solid_angle());
  }

  EmissionPdf pdf_emission(const SurfaceHit&, const Vec3&) const override {
    return {1, warp::sphere_pdf_solid_angle()};
  }

  Spectrum power() const override { return intensity_ * (4 * kPi); }

 private:
  Vec3 position_;
  Spectrum intensity_;
};

}  // namespace

std::shared_ptr<Emitter> make_point(Parameters& parameters) { return std::make_shared<PointLight>(parameters); }

}  // namespace covary
