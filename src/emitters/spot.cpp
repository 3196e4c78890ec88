// SPDX-License-Identifier: Apache-2.0
// `spot`: light from one point into a cone around the z axis. The intensity is constant up to beam_width and falls
// linearly in the angle to zero at cutoff_angle.
//
// | parameter    | type      | default          | meaning                                                       |
// |--------------|-----------|------------------|---------------------------------------------------------------|
// | intensity    | colour    | 1                | power per unit solid angle in the middle                      |
// | cutoff_angle | float     | 20               | half angle of the cone in degrees, in (0, 180)                |
// | beam_width   | float     | 0.75 * cutoff    | half angle of full intensity in degrees, up to cutoff_angle   |
// | texture      | texture   | none             | projected factor; its unit square spans the cone (cutoff < 90) |
// | to_world     | transform | identity         | the light stands at the image of the origin                   |
#include "core/warp.h"
#include "emitters/point_source.h"
#include "emitters/registry.h"

namespace covary {
namespace {

struct SpotSettings {
  PointFrame frame;
  Spectrum intensity;
  float cutoff = 0, beam_width = 0;  // radians, 0 <= beam_width <= cutoff
  TexturePtr texture;                // or null
};

class SpotLight final : public Emitter {
 public:
  explicit SpotLight(SpotSettings settings)
      : s_(std::move(settings)),
        cos_cutoff_(std::cos(s_.cutoff)),
        cos_beam_(std::cos(s_.beam_width)),
        one_minus_cos_cutoff_(2 * sqr(std::sin(s_.cutoff / 2))) {}

  bool is_delta_position() const override { return true; }

  EmitterSample sample_towards(const Vec3& reference, Vec2, float) const override {
    return sample_point(s_.frame.position, reference,
                        [&](const Vec3& d) { return intensity(s_.frame.rotation.to_local(d)); });
  }

  /// Uniform in the cone.
  EmissionSample sample_emission(Vec2, Vec2 u_direction, float) const override {
    const Vec3 local = warp::square_to_cone(u_direction, one_minus_cos_cutoff_);
    return emit_from_point(s_.frame.position, s_.frame.rotation.to_world(local), intensity(local),
                           warp::cone_pdf_solid_angle(one_minus_cos_cutoff_));
  }

  EmissionPdf pdf_emission(const SurfaceHit&, const Vec3& w) const override {
    const bool inside = s_.frame.rotation.to_local(w).z > cos_cutoff_;
    return {1, inside ? warp::cone_pdf_solid_angle(one_minus_cos_cutoff_) : 0};
  }

  Spectrum power() const override {
    const float c = s_.cutoff, b = s_.beam_width;
    if (!s_.texture) {
      // 2 pi times the integral of sin(t) up to b and of sin(t) (c - t) / (c - b) from b to c.
      const float mean_cosine = c - b > 1e-4f ? (std::sin(c) - std::sin(b)) / (c - b) : std::cos(c);
      return s_.intensity * (kTwoPi * (1 - mean_cosine));
    }
    const float side = 2 * std::tan(c);  // of the texture's square at distance 1
    return mean_over_texture(*s_.texture, [&](const Vec2& uv, float pdf) {
      const Vec3 local = normalize(Vec3{(uv.x - 0.5f) * side, (uv.y - 0.5f) * side, 1});
      const float solid_angle = sqr(side) * local.z * sqr(local.z) / pdf;
      return intensity(local) * solid_angle;
    });
  }
  bool knows_power() const override { return !s_.texture || s_.texture->is_constant(); }

 private:
  /// Power per unit solid angle in the unit direction `local` away from the light.
  Spectrum intensity(const Vec3& local) const {
    if (!(local.z > cos_cutoff_)) return Spectrum();
    float falloff = 1;
    if (local.z < cos_beam_) falloff = (s_.cutoff - std::acos(local.z)) / (s_.cutoff - s_.beam_width);
    const Spectrum value = s_.intensity * std::max(falloff, 0.0f);
    if (!s_.texture) return value;
    SurfaceHit hit;
    const float scale = 0.5f / (local.z * std::tan(s_.cutoff));
    hit.uv = {0.5f + local.x * scale, 0.5f + local.y * scale};
    return value * s_.texture->eval(hit);
  }

  SpotSettings s_;
  float cos_cutoff_, cos_beam_, one_minus_cos_cutoff_;
};

}  // namespace

std::shared_ptr<Emitter> make_spot(Parameters& parameters) {
  SpotSettings settings;
  settings.intensity = parameters.get_spectrum("intensity", Spectrum(1), SpectrumRole::kEmission);
  float cutoff = parameters.get_float("cutoff_angle", 20, 0, 180);
  const float beam_width = parameters.get_float("beam_width", 0.75f * cutoff, 0, 180);
  settings.texture = parameters.find_texture("texture");
  if (!(cutoff > 0 && cutoff < 180) || (settings.texture && cutoff >= 90)) {
    parameters.error_at("cutoff_angle", settings.texture
                                            ? "must lie between 0 and 90 degrees for a light with a texture"
                                            : "must lie between 0 and 180 degrees");
    cutoff = 20;
  }
  if (beam_width > cutoff) parameters.error_at("beam_width", "must not exceed cutoff_angle");
  settings.cutoff = cutoff * (kPi / 180);
  settings.beam_width = std::min(beam_width, cutoff) * (kPi / 180);
  settings.frame = get_point_frame(parameters);
  return std::make_shared<SpotLight>(std::move(settings));
}

}  // namespace covary
