// SPDX-License-Identifier: Apache-2.0
// sunsky: a clear sky and the sun, from a model (sky_model.h). z is up; black below the horizon, and everywhere at
// night.
//
// | parameter            | type      | default        | meaning                                                       |
// |----------------------|-----------|----------------|---------------------------------------------------------------|
// | turbidity            | float     | 3              | haze, from 1, very clear, to 10                               |
// | albedo               | colour    | 0.3            | of the ground, which shines back on the sky                   |
// | sun_direction        | vector    |                | towards the sun, in world space; instead of place and time    |
// | latitude, longitude  | float     | 35.6894,       | degrees north and east: Tokyo                                 |
// |                      |           | 139.6917       |                                                               |
// | timezone             | float     | 9              | hours ahead of UTC                                            |
// | year, month, day     | integer   | 2010, 7, 10    |                                                               |
// | hour, minute, second | float     | 15, 0, 0       | local time                                                    |
// | sun_scale, sky_scale | float     | 1              | factors; 0 removes the sun or the sky                         |
// | sun_aperture         | float     | 0.5358         | angular diameter in degrees; does not change its irradiance   |
// | complex_sun          | boolean   | false          | limb darkening: the disk is brighter at its centre            |
// | to_world             | transform | identity       | rotation                                                      |
//
// Sampling: the sun's cone uniformly, or the sky by a table of its luminance, chosen in proportion to their power.
#include <cmath>
#include <memory>
#include <optional>
#include <vector>

#include "core/distribution.h"
#include "core/warp.h"
#include "emitters/registry.h"
#include "emitters/rotation.h"
#include "emitters/scene_sphere.h"
#include "emitters/sky_model.h"

namespace covary {
namespace {

/// The light in the local frame of the sky; large, shared by copies.
class Dome {
 public:
  Dome(const std::optional<SkyModel>& sky, float sky_scale, const std::optional<SunModel>& sun, float sun_scale,
       const Vec3& to_sun)
      : sky_(sky), sun_(sun), sky_scale_(sky_scale), sun_scale_(sun_scale), sun_frame_(to_sun) {
    const Spectrum from_sky = tabulate_sky(), from_sun = integrate_sun();
    integral_ = from_sky + from_sun;
    const float both = luminance(integral_);
    sun_pmf_ = both > 0 ? luminance(from_sun) / both : 0;
    black_ = !(both > 0);
  }

  EnvironmentLight at(const Vec3& w) const {
    if (!(w.z >= 0) || black_) return {};
    EnvironmentLight light;
    if (sky_) {
      light.radiance = sky_->radiance(w) * sky_scale_;
      if (sun_pmf_ < 1) light.pdf_solid_angle = (1 - sun_pmf_) * table_.pdf(to_square(w)) / kTwoPi;
    }
    if (sun_ && sun_->on_disk(w)) {
      light.radiance += sun_->radiance(w) * sun_scale_;
      light.pdf_solid_angle += sun_pmf_ * warp::cone_pdf_solid_angle(sun_->one_minus_cos());
    }
    return light;
  }

  Vec3 sample(Vec2 u) const {
    if (u.x < sun_pmf_) return sun_frame_.to_world(warp::square_to_cone({u.x / sun_pmf_, u.y}, sun_->one_minus_cos()));
    if (!sky_ || sun_pmf_ >= 1) return {0, 0, -1};  // black
    const Vec2 at = table_.sample({std::min((u.x - sun_pmf_) / (1 - sun_pmf_), kOneMinusEpsilon), u.y}).uv;
    const float z = at.y, r = safe_sqrt(1 - z * z);
    const SinCos phi = sincos_turns(at.x);
    return {r * phi.cos, r * phi.sin, z};
  }

  /// Integral of radiance over all directions.
  const Spectrum& integral() const { return integral_; }

 private:
  /// Cells of equal solid angle: azimuth and z.
  static constexpr int kWidth = 256, kHeight = 128;
  static Vec2 to_square(const Vec3& w) { return {angle_turns(w.y, w.x), std::min(w.z, kOneMinusEpsilon)}; }

  /// Builds the sampling table; returns the sky's integral, from four points per cell.
  Spectrum tabulate_sky() {
    if (!sky_) return Spectrum(0);
    std::vector<float> weights;
    Spectrum integral(0);
    double sum = 0;
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) {
        Spectrum cell(0);
        for (int i = 0; i < 4; ++i) {
          const float z = (static_cast<float>(y) + 0.25f + 0.5f * static_cast<float>(i / 2)) / kHeight;
          const SinCos phi = sincos_turns((static_cast<float>(x) + 0.25f + 0.5f * static_cast<float>(i % 2)) / kWidth);
          const float r = safe_sqrt(1 - z * z);
          cell += sky_->radiance({r * phi.cos, r * phi.sin, z}) * (0.25f * sky_scale_);
        }
        weights.push_back(luminance(cell));
        sum += luminance(cell);
        integral += cell * (kTwoPi / (kWidth * kHeight));
      }
    if (!(sum > 0)) {
      sky_.reset();
      return Spectrum(0);
    }
    // Where the points of a cell are black, others may not be: a minimum weight.
    const auto least = static_cast<float>(1e-3 * sum / (kWidth * kHeight));
    for (float& weight : weights) weight = std::max(weight, least);
    table_ = PiecewiseConstant2D(weights, kWidth, kHeight);
    return integral;
  }
  Spectrum integrate_sun() {
    if (!sun_) return Spectrum(0);
    constexpr int kSide = 32;
    Spectrum sum(0);
    for (int y = 0; y < kSide; ++y)
      for (int x = 0; x < kSide; ++x) {
        const Vec2 u = Vec2{static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f} * (1.0f / kSide);
        sum += sun_->radiance(sun_frame_.to_world(warp::square_to_cone(u, sun_->one_minus_cos())));
      }
    if (!(luminance(sum) > 0)) sun_.reset();
    return sum * (sun_scale_ * kTwoPi * (sun_ ? sun_->one_minus_cos() : 0) / (kSide * kSide));
  }

  std::optional<SkyModel> sky_;
  std::optional<SunModel> sun_;
  float sky_scale_, sun_scale_;
  Frame sun_frame_;
  PiecewiseConstant2D table_;
  Spectrum integral_;
  float sun_pmf_ = 0;
  bool black_ = true;
};

class SunSky final : public Emitter {
 public:
  SunSky(std::shared_ptr<const Dome> dome, const Rotation& rotation) : dome_(std::move(dome)), rotation_(rotation) {}

  std::shared_ptr<const Emitter> in_scene(const Bounds3& bounds) const override {
    auto placed = std::make_shared<SunSky>(*this);
    placed->scene_ = SceneSphere(bounds);
    return placed;
  }
  bool is_environment() const override { return true; }
  EnvironmentLight environment(const Vec3& d) const override { return dome_->at(rotation_.to_local(d)); }

  EmitterSample sample_towards(const Vec3&, Vec2 u, float) const override {
    const Vec3 d = dome_->sample(u);
    const EnvironmentLight light = dome_->at(d);
    EmitterSample sample;
    sample.wi = rotation_.to_world(d);
    sample.radiance = light.radiance;
    sample.pdf_solid_angle = light.pdf_solid_angle;
    return sample;
  }
  EmissionSample sample_emission(Vec2 u_position, Vec2 u_direction, float) const override {
    const Vec3 from = dome_->sample(u_direction);
    const EnvironmentLight light = dome_->at(from);
    return scene_.emission(-rotation_.to_world(from), u_position, light.radiance, light.pdf_solid_angle);
  }
  EmissionPdf pdf_emission(const SurfaceHit&, const Vec3& w) const override {
    return {1 / scene_.disk_area(), environment(-w).pdf_solid_angle};
  }
  Spectrum power() const override { return dome_->integral() * scene_.disk_area(); }

 private:
  std::shared_ptr<const Dome> dome_;
  Rotation rotation_;
  SceneSphere scene_;
};

/// The sun's direction in the frame of the sky.
Vec3 get_sun(Parameters& parameters, const Rotation& rotation) {
  SunTime t{};
  bool timed = false;
  for (const char* name : {"latitude", "longitude", "timezone", "year", "month", "day", "hour", "minute", "second"})
    timed = parameters.has(name) || timed;
  t.latitude = parameters.get_float("latitude", 35.6894f, -90, 90);
  t.longitude = parameters.get_float("longitude", 139.6917f, -360, 360);
  t.timezone = parameters.get_float("timezone", 9, -24, 24);
  t.year = parameters.get_int("year", 2010, 1600, 2400);
  t.month = parameters.get_int("month", 7, 1, 12);
  t.day = parameters.get_int("day", 10, 1, 31);
  t.hour = parameters.get_float("hour", 15, 0, 24);
  t.minute = parameters.get_float("minute", 0, 0, 60);
  t.second = parameters.get_float("second", 0, 0, 60);
  if (!parameters.has("sun_direction")) return sun_position(t);
  if (timed) parameters.error_at("sun_direction", "cannot be combined with a place and time");
  const Vec3 d = parameters.get_vec3("sun_direction", {0, 0, 1});
  if (!(length(d) > 0)) {
    parameters.error_at("sun_direction", "has length zero");
    return {0, 0, 1};
  }
  return normalize(rotation.to_local(d));
}

}  // namespace

std::shared_ptr<Emitter> make_sunsky(Parameters& parameters) {
  Rotation rotation;
  try {
    rotation = Rotation(parameters.get_transform("to_world"));
  } catch (const Error& error) {
    parameters.error_at("to_world", error.what());
  }
  const Vec3 to_sun = get_sun(parameters, rotation);
  const float turbidity = parameters.get_float("turbidity", 3, 1, 10);
  const Spectrum albedo = parameters.get_spectrum("albedo", Spectrum(0.3f), SpectrumRole::kReflectance);
  for (int c = 0; c < 3; ++c)
    if (!(albedo[c] >= 0 && albedo[c] <= 1)) {
      parameters.error_at("albedo", "is outside [0, 1]");
      return nullptr;
    }
  const float sun_scale = parameters.get_float("sun_scale", 1, 0), sky_scale = parameters.get_float("sky_scale", 1, 0);
  const float half_angle = parameters.get_float("sun_aperture", 0.5358f, 1e-3f, 179) / 2 * kPi / 180;
  const bool complex_sun = parameters.get_bool("complex_sun", false);
  std::optional<SkyModel> sky;
  std::optional<SunModel> sun;
  if (!(to_sun.z >= 0))
    parameters.warn("the sun is below the horizon: the sky is black");
  else {
    if (sky_scale > 0) sky.emplace(turbidity, albedo, to_sun);
    if (sun_scale > 0) sun.emplace(turbidity, to_sun, half_angle, complex_sun);
  }
  return std::make_shared<SunSky>(std::make_shared<const Dome>(sky, sky_scale, sun, sun_scale, to_sun), rotation);
}

}  // namespace covary
