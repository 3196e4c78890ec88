// SPDX-License-Identifier: Apache-2.0
// homogeneous: constant extinction. heterogeneous: varying extinction inside the box around its volume.
//
// | name           | type          | default | meaning                                                            |
// |----------------|---------------|---------|--------------------------------------------------------------------|
// | sigma_t        | colour/volume | 1       | extinction per unit of length; `homogeneous`: constant             |
// | albedo         | colour/volume | 0.75    | fraction of it that is scattering, in [0, 1]                       |
// | sigma_a, sigma_s | colour      |         | absorption and scattering, instead of sigma_t and albedo           |
// | scale          | float         | 1       | factor on sigma_t                                                  |
// | radiance       | colour/volume | 0       | emitted per absorbed fraction: sigma_t (1 - albedo) scale radiance |
// |                |               |         | per unit of length                                                 |
// | sample_emitters | boolean      | true    | whether points in the medium sample lights                         |
// | has_spectral_extinction | boolean |       | accepted, no effect                                                |
// | (nested)       | phase         | isotropic |                                                                  |
//
// constvolume: one value everywhere.
//
// | name     | type      | default  | meaning                              |
// |----------|-----------|----------|--------------------------------------|
// | value    | colour    | 1        |                                      |
// | to_world | transform | identity | moves the unit cube, which is its box |
#include <fmt/format.h>

#include "core/transform.h"
#include "media/registry.h"
#include "scene/volume.h"

namespace covary {
namespace {

/// The same value everywhere in its box, the unit cube moved by `to_world`, as in Mitsuba.
class ConstantVolume final : public Volume {
 public:
  explicit ConstantVolume(const Spectrum& value, const Transform& to_world = {})
      : value_(value), bounds_(to_world.bounds({{0, 0, 0}, {1, 1, 1}})) {}
  Spectrum eval(const Vec3&) const override { return value_; }
  Spectrum largest() const override { return value_; }
  Spectrum smallest() const override { return value_; }
  Bounds3 bounds() const override { return bounds_; }
  bool is_constant() const override { return true; }

 private:
  Spectrum value_;
  Bounds3 bounds_;
};

/// Upper bound on collisions along a ray in a heterogeneous medium: beyond it, tracking would take too long, or steps
/// would vanish in rounding.
constexpr float kMaxCollisions = 1e6f;

bool not_negative(const Spectrum& s) { return is_finite(s) && s.r >= 0 && s.g >= 0 && s.b >= 0; }

/// The volume parameter; numbers and colours become constant volumes. Null after recording an error.
VolumePtr volume(Parameters& p, const std::string& name, float fallback, SpectrumRole role) {
  if (p.holds_object(name)) return std::dynamic_pointer_cast<const Volume>(p.find_object(name, "volume"));
  return std::make_shared<ConstantVolume>(p.get_spectrum(name, Spectrum(fallback), role));
}

/// sigma_t and albedo, or the constant sigma_a and sigma_s of Mitsuba 0.x, which determine them.
void read_coefficients(Parameters& p, MediumSettings& settings) {
  if (!p.has("sigma_a") && !p.has("sigma_s")) {
    settings.extinction = volume(p, "sigma_t", 1, SpectrumRole::kIndex);
    settings.albedo = volume(p, "albedo", 0.75f, SpectrumRole::kReflectance);
    return;
  }
  for (const char* other : {"sigma_t", "albedo"})
    if (p.has(other)) p.error_at(other, "is given together with 'sigma_a' or 'sigma_s'; expected one or the other");
  const Spectrum absorbed = p.get_spectrum("sigma_a", Spectrum(0), SpectrumRole::kIndex);
  const Spectrum scattered = p.get_spectrum("sigma_s", Spectrum(0), SpectrumRole::kIndex);
  const Spectrum extinction = absorbed + scattered;
  Spectrum albedo;
  for (int c = 0; c < 3; ++c) albedo[c] = extinction[c] > 0 ? scattered[c] / extinction[c] : 0;
  settings.extinction = std::make_shared<ConstantVolume>(extinction);
  settings.albedo = std::make_shared<ConstantVolume>(albedo);
}

void read_radiance(Parameters& p, MediumSettings& settings) {
  if (!p.has("radiance")) return;
  if (p.holds_object("radiance")) {
    settings.radiance = std::dynamic_pointer_cast<const Volume>(p.find_object("radiance", "volume"));
    if (settings.homogeneous && settings.radiance && !settings.radiance->is_constant())
      p.error_at("radiance", "varies; a medium of varying radiance is a medium 'heterogeneous'");
  } else {
    settings.radiance =
        std::make_shared<ConstantVolume>(p.get_spectrum("radiance", Spectrum(0), SpectrumRole::kEmission));
  }
  if (!settings.radiance) return;  // reported
  if (!not_negative(settings.radiance->smallest()) || !not_negative(settings.radiance->largest()))
    p.error_at("radiance", "has values that are negative or not finite");
  if (is_black(settings.radiance->largest())) settings.radiance = nullptr;
}

std::shared_ptr<Medium> make_medium(Parameters& p, bool homogeneous) {
  MediumSettings settings;
  settings.homogeneous = homogeneous;
  read_coefficients(p, settings);
  settings.scale = p.get_float("scale", 1, 0);
  read_radiance(p, settings);
  settings.sample_lights = p.get_bool("sample_emitters", true);
  p.get_bool("has_spectral_extinction", true);
  const auto phases = p.children<PhaseFunction>("phase");
  if (phases.size() > 1) p.error(fmt::format("has {} phases; expected one", phases.size()));
  if (!settings.extinction || !settings.albedo) return nullptr;
  if (homogeneous && !settings.extinction->is_constant())
    p.error_at("sigma_t", "varies; a medium of varying extinction is a medium 'heterogeneous'");
  if (!not_negative(settings.extinction->smallest()) || !not_negative(settings.extinction->largest() * settings.scale))
    p.error_at("sigma_t", "has values that are negative or not finite");
  if (!not_negative(settings.albedo->smallest()) || !(max_component(settings.albedo->largest()) <= 1))
    p.error_at("albedo", "has values outside [0, 1]");
  const Bounds3 box = settings.extinction->bounds();
  const float collisions =
      max_component(settings.extinction->largest() * settings.scale) * length(box.upper - box.lower);
  if (!homogeneous && !(collisions <= kMaxCollisions))
    p.error_at("sigma_t", fmt::format("makes a ray collide {:.3g} times on the way through the box; at most {:.0f} are "
                                      "accepted (is 'scale' right?)",
                                      collisions, kMaxCollisions));
  settings.phase = phases.empty() ? isotropic_phase() : phases[0];
  return std::make_shared<Medium>(std::move(settings));
}

}  // namespace

std::shared_ptr<Medium> make_homogeneous(Parameters& p) { return make_medium(p, true); }
std::shared_ptr<Medium> make_heterogeneous(Parameters& p) { return make_medium(p, false); }

std::shared_ptr<Volume> make_constvolume(Parameters& p) {
  const Spectrum value = p.get_spectrum("value", Spectrum(1), SpectrumRole::kIndex);
  return std::make_shared<ConstantVolume>(value, p.get_transform("to_world"));
}

}  // namespace covary
