// SPDX-License-Identifier: Apache-2.0
// `projector`: the reverse of a pinhole camera. From one point it throws a picture, whose irradiance on a plane across
// its axis is that of the texture, times pi, at distance 1: with it the radiance of a white diffuse plane there is the
// texture's.
//
// | parameter    | type      | default  | meaning                                                                  |
// |--------------|-----------|----------|--------------------------------------------------------------------------|
// | irradiance   | texture   | 1        | the picture                                                              |
// | scale        | float     | 1        | factor                                                                   |
// | fov, fov_axis, focal_length |  | 50mm | as of the sensor `perspective`; the picture's pixels give the aspect      |
// | to_world     | transform | identity | shines along the image of +z, the picture's y axis up, x to the left      |
#include "emitters/point_source.h"
#include "emitters/registry.h"
#include "scene/field_of_view.h"

namespace covary {
namespace {

struct ProjectorSettings {
  PointFrame frame;
  TexturePtr irradiance;
  float scale = 1;
  float tan_x = 1, tan_y = 1;  // half extents of the picture at distance 1
};

class Projector final : public Emitter {
 public:
  explicit Projector(ProjectorSettings settings) : s_(std::move(settings)) {}

  bool is_delta_position() const override { return true; }

  EmitterSample sample_towards(const Vec3& reference, Vec2, float) const override {
    return sample_point(s_.frame.position, reference,
                        [&](const Vec3& d) { return intensity(s_.frame.rotation.to_local(d)); });
  }

  /// Positions in the picture by its luminance.
  EmissionSample sample_emission(Vec2, Vec2 u_direction, float) const override {
    const Texture::PositionSample at = s_.irradiance->sample_position(u_direction);
    if (!(at.pdf > 0)) return {};
    const Vec3 local = direction(at.uv);
    return emit_from_point(s_.frame.position, s_.frame.rotation.to_world(local), intensity_at(at.uv, local.z),
                           at.pdf * per_solid_angle(local.z));
  }

  EmissionPdf pdf_emission(const SurfaceHit&, const Vec3& w) const override {
    const Vec3 local = s_.frame.rotation.to_local(w);
    Vec2 uv;
    return {1, find(local, uv) ? s_.irradiance->pdf_position(uv) * per_solid_angle(local.z) : 0};
  }

  /// Of an intensity pi E / cos^3 the integral over directions is pi times that of E over the picture at distance 1.
  Spectrum power() const override {
    const float area = kPi * s_.scale * 4 * s_.tan_x * s_.tan_y;
    SurfaceHit hit;
    if (s_.irradiance->is_constant()) return s_.irradiance->eval(hit) * area;
    return mean_over_texture(*s_.irradiance,
                             [&](const Vec2& uv, float pdf) {
                               hit.uv = uv;
                               return s_.irradiance->eval(hit) / Spectrum(pdf);
                             }) *
           area;
  }
  bool knows_power() const override { return s_.irradiance->is_constant(); }

 private:
  Vec3 direction(Vec2 uv) const { return normalize(Vec3{(1 - 2 * uv.x) * s_.tan_x, (1 - 2 * uv.y) * s_.tan_y, 1}); }
  /// The point of the picture in the unit direction `local`; false: it is outside.
  bool find(const Vec3& local, Vec2& uv) const {
    if (!(local.z > 0)) return false;
    uv = {0.5f * (1 - local.x / (local.z * s_.tan_x)), 0.5f * (1 - local.y / (local.z * s_.tan_y))};
    return uv.x >= 0 && uv.x <= 1 && uv.y >= 0 && uv.y <= 1;
  }
  /// Density per unit solid angle of what has density 1 in the picture's unit square.
  float per_solid_angle(float cosine) const { return 1 / (4 * s_.tan_x * s_.tan_y * cosine * cosine * cosine); }
  /// Power per unit solid angle.
  Spectrum intensity_at(Vec2 uv, float cosine) const {
    SurfaceHit hit;
    hit.uv = uv;
    return s_.irradiance->eval(hit) * (kPi * s_.scale / (cosine * cosine * cosine));
  }
  Spectrum intensity(const Vec3& local) const {
    Vec2 uv;
    return find(local, uv) ? intensity_at(uv, local.z) : Spectrum();
  }

  ProjectorSettings s_;
};

}  // namespace

std::shared_ptr<Emitter> make_projector(Parameters& parameters) {
  ProjectorSettings settings;
  settings.irradiance = parameters.get_texture("irradiance", Spectrum(1), SpectrumRole::kEmission);
  settings.scale = parameters.get_float("scale", 1, 0);
  const FieldOfView view = get_field_of_view(parameters);
  const float aspect = settings.irradiance->aspect();
  settings.tan_x = half_extent_x(view.degrees, view.axis, aspect);
  settings.tan_y = settings.tan_x / aspect;
  settings.frame = get_point_frame(parameters);
  return std::make_shared<Projector>(std::move(settings));
}

}  // namespace covary
