// SPDX-License-Identifier: Apache-2.0
// `spot`: a point light restricted to a cone around the z axis. The intensity is constant up to beam_width and falls
// linearly in the angle to zero at cutoff_angle.
//
// | parameter    | type      | default          | meaning                                                       |
// |--------------|-----------|------------------|---------------------------------------------------------------|
// | intensity    | colour    | 1                | power per unit solid angle at the centre                      |
// | cutoff_angle | float     | 20               | half angle of the cone in degrees, in (0, 180)                |
// | beam_width   | float     | 0.75 * cutoff    | half angle of full intensity in degrees, up to cutoff_angle   |
// | texture      | texture   | none             | projected factor; its unit square spans the cone (cutoff < 90) |
// | to_world     | transform | identity         | the light stands at the image of the origin                   |
#include "core/warp.h"
#include "emitters/point_source.h"
#include "emitters/registry.h"

namespace covary {
namespace {

class SpotLight final : public Emitter {
 public:
  explicit SpotLight(Parameters& p)
      : frame_(get_point_frame(p)),
        intensity_(p.get_spectrum("intensity", Spectrum(1), SpectrumRole::kEmission)),
        texture_(p.find_texture("texture")) {
    float cutoff = p.get_float("cutoff_angle", 20, 0, 180);
    const float beam_width = p.get_float("beam_width", 0.75f * cutoff, 0, 180);
    if (!(cutoff > 0 && cutoff < 180) || (texture_ && cutoff >= 90)) {
      p.error_at("cutoff_angle", texture_ ? "must lie between 0 and 90 degrees for a light with a texture"
                                          : "must lie between 0 and 180 degrees");
      cutoff = 20;
    }
    if (beam_width > cutoff) p.error_at("beam_width", "must not exceed cutoff_angle");
    cutoff_ = cutoff * (kPi / 180), beam_width_ = std::min(beam_width, cutoff) * (kPi / 180);
    cos_cutoff_ = std::cos(cutoff_), cos_beam_ = std::cos(beam_width_);
    one_minus_cos_cutoff_ = 2 * sqr(std::sin(cutoff_ / 2));
  }

  bool is_delta_position() const override { return true; }

  EmitterSample sample_towards(const Vec3& reference, Vec2, float) const override {
    return sample_point(frame_.position, reference,
                        [&](const Vec3& d) { return intensity(frame_.rotation.to_local(d)); });
  }

  /// Uniform in the cone.
  EmissionSample sample_emission(Vec2, Vec2 u_direction, float) const override {
    const Vec3 local = warp::square_to_cone(u_direction, one_minus_cos_cutoff_);
    return emit_from_point(frame_.position, frame_.rotation.to_world(local), intensity(local),
                           warp::cone_pdf_solid_angle(one_minus_cos_cutoff_));
  }

  EmissionPdf pdf_emission(const SurfaceHit&, const Vec3& w) const override {
    const bool inside = frame_.rotation.to_local(w).z > cos_cutoff_;
    return {1, inside ? warp::cone_pdf_solid_angle(one_minus_cos_cutoff_) : 0};
  }

  Spectrum power() const override {
    const float c = cutoff_, b = beam_width_;
    if (!texture_) {
      // 2 pi times the integral of sin(t) up to b and of sin(t) (c - t) / (c - b) from b to c.
      const float mean_cosine = c - b > 1e-4f ? (std::sin(c) - std::sin(b)) / (c - b) : std::cos(c);
      return intensity_ * (kTwoPi * (1 - mean_cosine));
    }
    const float side = 2 * std::tan(c);  // of the texture's square at distance 1
    return mean_over_texture(*texture_, [&](const Vec2& uv, float pdf) {
      const Vec3 local = normalize(Vec3{(uv.x - 0.5f) * side, (uv.y - 0.5f) * side, 1});
      const float solid_angle = sqr(side) * local.z * sqr(local.z) / pdf;
      return intensity(local) * solid_angle;
    });
  }
  bool knows_power() const override { return !texture_ || texture_->is_constant(); }

 private:
  /// Power per unit solid angle in the unit direction `local` away from the light.
  Spectrum intensity(const Vec3& local) const {
    if (!(local.z > cos_cutoff_)) return Spectrum();
    float falloff = 1;
    if (local.z < cos_beam_) falloff = (cutoff_ - std::acos(local.z)) / (cutoff_ - beam_width_);
    const Spectrum value = intensity_ * std::max(falloff, 0.0f);
    if (!texture_) return value;
    SurfaceHit hit;
    const float scale = 0.5f / (local.z * std::tan(cutoff_));
    hit.uv = {0.5f + local.x * scale, 0.5f + local.y * scale};
    return value * texture_->eval(hit);
  }

  PointFrame frame_;
  Spectrum intensity_;
  TexturePtr texture_;         // may be null
  float cutoff_, beam_width_;  // radians, 0 <= beam_width <= cutoff
  float cos_cutoff_, cos_beam_, one_minus_cos_cutoff_;
};

}  // namespace

std::shared_ptr<Emitter> make_spot(Parameters& parameters) { return std::make_shared<SpotLight>(parameters); }

}  // namespace covary
