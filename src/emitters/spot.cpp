// SPDX-License-Identifier: Apache-2.0
// `spot`: a point light restricted to a cone around the z axis. The intensity is constant up to beam_width and falls to
// zero at cutoff_angle: with the fraction t of the way back to the beam, as t in the angle (Mitsuba), as t^2 in the
// cosine (glTF: KHR_lights_punctual), or as 3 t^2 - 2 t^3 in the cosine (pbrt).
//
// | parameter    | type      | default          | meaning                                                       |
// |--------------|-----------|------------------|---------------------------------------------------------------|
// | intensity    | colour    | 1                | power per unit solid angle at the centre                      |
// | cutoff_angle | float     | 20               | half angle of the cone in degrees, in (0, 180)                |
// | beam_width   | float     | 0.75 * cutoff    | half angle of full intensity in degrees, up to cutoff_angle   |
// | falloff      | string    | linear           | or `squared` or `smooth`, see above                           |
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
    const std::string falloff = p.get_choice("falloff", "linear", {"linear", "squared", "smooth"});
    falloff_ = falloff == "squared" ? Falloff::kSquared : falloff == "smooth" ? Falloff::kSmooth : Falloff::kLinear;
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
      if (falloff_ != Falloff::kLinear) {  // the means of t^2 and of 3 t^2 - 2 t^3 are 1 / 3 and 1 / 2
        const float edge = (cos_beam_ - cos_cutoff_) * (falloff_ == Falloff::kSquared ? 1.0f / 3 : 0.5f);
        return intensity_ * (kTwoPi * (1 - cos_beam_ + edge));
      }
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
  enum class Falloff : uint8_t { kLinear, kSquared, kSmooth };

  /// Between beam and cutoff, for a direction with the cosine `z`.
  float edge(float z) const {
    if (falloff_ == Falloff::kLinear) return std::max((cutoff_ - std::acos(z)) / (cutoff_ - beam_width_), 0.0f);
    const float t = (z - cos_cutoff_) / (cos_beam_ - cos_cutoff_);
    return falloff_ == Falloff::kSquared ? t * t : t * t * (3 - 2 * t);
  }
  /// Power per unit solid angle in the unit direction `local` away from the light.
  Spectrum intensity(const Vec3& local) const {
    if (!(local.z > cos_cutoff_)) return Spectrum();
    const Spectrum value = intensity_ * (local.z < cos_beam_ ? edge(local.z) : 1);
    if (!texture_) return value;
    SurfaceHit hit;
    const float scale = 0.5f / (local.z * std::tan(cutoff_));
    hit.uv = {0.5f + local.x * scale, 0.5f + local.y * scale};
    return value * texture_->eval(hit);
  }

  PointFrame frame_;
  Spectrum intensity_;
  TexturePtr texture_;  // may be null
  Falloff falloff_;
  float cutoff_, beam_width_;  // radians, 0 <= beam_width <= cutoff
  float cos_cutoff_, cos_beam_, one_minus_cos_cutoff_;
};

}  // namespace

std::shared_ptr<Emitter> make_spot(Parameters& parameters) { return std::make_shared<SpotLight>(parameters); }

}  // namespace covary
