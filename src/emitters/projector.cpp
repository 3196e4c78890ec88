// SPDX-License-Identifier: Apache-2.0
// `projector`: the inverse of a pinhole camera. Projects an image from a point; on a plane perpendicular to the axis at
// distance 1, the irradiance is pi times the texture, so that a white diffuse plane there has the texture's radiance.
//
// | parameter    | type      | default  | meaning                                                                  |
// |--------------|-----------|----------|--------------------------------------------------------------------------|
// | irradiance   | texture   | 1        | the picture                                                              |
// | scale        | float     | 1        | factor                                                                   |
// | constant_intensity | boolean | false | our own: the texture is the power per unit solid angle, as in pbrt        |
// | power        | float     | none     | our own: luminance of the emitted power, by a factor                     |
// | fov, fov_axis, focal_length |  | 50mm | as of the sensor `perspective`; the picture's pixels give the aspect      |
// | to_world     | transform | identity | shines along the image of +z, the picture's y axis up, x to the left      |
#include "emitters/point_source.h"
#include "emitters/registry.h"
#include "scene/field_of_view.h"

namespace covary {
namespace {

class Projector final : public Emitter {
 public:
  explicit Projector(Parameters& p)
      : frame_(get_point_frame(p)),
        irradiance_(p.get_texture("irradiance", Spectrum(1), SpectrumRole::kEmission)),
        scale_(p.get_float("scale", 1, 0)),
        constant_intensity_(p.get_bool("constant_intensity", false)) {
    const FieldOfView view = get_field_of_view(p);
    const float aspect = irradiance_->aspect();
    tan_x_ = half_extent_x(view.degrees, view.axis, aspect), tan_y_ = tan_x_ / aspect;
    const float wanted = p.get_float("power", 0, 0), given = luminance(power());
    if (wanted > 0 && given > 0) scale_ *= wanted / given;
  }

  bool is_delta_position() const override { return true; }

  EmitterSample sample_towards(const Vec3& reference, Vec2, float) const override {
    return sample_point(frame_.position, reference,
                        [&](const Vec3& d) { return intensity(frame_.rotation.to_local(d)); });
  }

  /// Samples positions in the image by luminance.
  EmissionSample sample_emission(Vec2, Vec2 u_direction, float) const override {
    const Texture::PositionSample at = irradiance_->sample_position(u_direction);
    if (!(at.pdf > 0)) return {};
    const Vec3 local = direction(at.uv);
    return emit_from_point(frame_.position, frame_.rotation.to_world(local), intensity_at(at.uv, local.z),
                           at.pdf * per_solid_angle(local.z));
  }

  EmissionPdf pdf_emission(const SurfaceHit&, const Vec3& w) const override {
    const Vec3 local = frame_.rotation.to_local(w);
    Vec2 uv;
    return {1, find(local, uv) ? irradiance_->pdf_position(uv) * per_solid_angle(local.z) : 0};
  }

  /// The integral over directions becomes one over the image at distance 1: of pi E, or of I cos^3.
  Spectrum power() const override {
    const float area = 4 * tan_x_ * tan_y_;
    SurfaceHit hit;
    if (irradiance_->is_constant() && !constant_intensity_) return irradiance_->eval(hit) * (area * kPi * scale_);
    return mean_over_texture(*irradiance_, [&](const Vec2& uv, float pdf) {
      const float cosine = direction(uv).z;
      return intensity_at(uv, cosine) * (area * cosine * cosine * cosine / pdf);
    });
  }
  bool knows_power() const override { return irradiance_->is_constant() && !constant_intensity_; }

 private:
  Vec3 direction(Vec2 uv) const { return normalize(Vec3{(1 - 2 * uv.x) * tan_x_, (1 - 2 * uv.y) * tan_y_, 1}); }
  /// Image position in the unit direction `local`; false if outside.
  bool find(const Vec3& local, Vec2& uv) const {
    if (!(local.z > 0)) return false;
    uv = {0.5f * (1 - local.x / (local.z * tan_x_)), 0.5f * (1 - local.y / (local.z * tan_y_))};
    return uv.x >= 0 && uv.x <= 1 && uv.y >= 0 && uv.y <= 1;
  }
  /// Density per unit solid angle of a unit density on the image's unit square.
  float per_solid_angle(float cosine) const { return 1 / (4 * tan_x_ * tan_y_ * cosine * cosine * cosine); }
  /// Power per unit solid angle.
  Spectrum intensity_at(Vec2 uv, float cosine) const {
    SurfaceHit hit;
    hit.uv = uv;
    return irradiance_->eval(hit) * (constant_intensity_ ? scale_ : kPi * scale_ / (cosine * cosine * cosine));
  }
  Spectrum intensity(const Vec3& local) const {
    Vec2 uv;
    return find(local, uv) ? intensity_at(uv, local.z) : Spectrum();
  }

  PointFrame frame_;
  TexturePtr irradiance_;
  float scale_;
  bool constant_intensity_;
  float tan_x_, tan_y_;  // tan: half extents of the image at distance 1
};

}  // namespace

std::shared_ptr<Emitter> make_projector(Parameters& parameters) { return std::make_shared<Projector>(parameters); }

}  // namespace covary
