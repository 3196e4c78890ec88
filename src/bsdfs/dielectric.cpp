// SPDX-License-Identifier: Apache-2.0
// dielectric: a perfectly smooth interface between two transparent media, e.g. glass and air; mirror reflection and
// refraction from both sides. The interior is the side the normal points away from.
// thindielectric: a thin pane of glass: mirror reflection and straight transmission, from both sides.
//
// | name                   | type           | default | meaning                                           |
// |------------------------|----------------|---------|---------------------------------------------------|
// | int_ior                | number/string  | bk7     | index of refraction inside, or a material's name  |
// | ext_ior                | number/string  | air     | the same outside                                  |
// | specular_reflectance   | colour/texture | 1       | factor on the reflection; not physical unless 1   |
// | specular_transmittance | colour/texture | 1       | factor on transmission; not physical unless 1     |
//
// Reflection is sampled with the reflectance as its probability: the Fresnel reflectance R of an interface; for a pane
//     R + T R T + T R^3 T + ... = 2 R / (1 + R),   T = 1 - R.
// Refracted radiance is scaled by the squared ratio of indices (Veach 1997, Section 5.2); importance is not.
#include "bsdfs/fresnel.h"
#include "bsdfs/inputs.h"
#include "bsdfs/registry.h"

namespace covary {
namespace {

/// Mirror reflection with some probability, otherwise transmission.
class SmoothClosure : public BsdfClosure {
 public:
  SmoothClosure(float eta, TransportMode mode, const Spectrum& reflectance, const Spectrum& transmittance)
      : eta_(eta), mode_(mode), reflectance_(reflectance), transmittance_(transmittance) {}

  BsdfValue eval(const Vec3&, const Vec3&) const override { return {}; }
  int n_lobes() const override { return 2; }
  void lobe_pdfs(const Vec3&, const Vec3&, float* pdfs) const override { pdfs[0] = pdfs[1] = 0; }

 protected:
  ~SmoothClosure() = default;
  float eta_;
  TransportMode mode_;
  Spectrum reflectance_, transmittance_;
};

class DielectricClosure final : public SmoothClosure {
 public:
  using SmoothClosure::SmoothClosure;
  static constexpr uint32_t kFlags = kDeltaReflection | kDeltaTransmission;
  uint32_t flags() const override { return kFlags; }
  BsdfSample sample(const Vec3& wo, float u_lobe, Vec2) const override {
    const DielectricFresnel f = fresnel_dielectric(wo.z, eta_);
    if (u_lobe < f.reflectance)
      return {.wi = reflect(wo), .weight = reflectance_, .pdf = f.reflectance, .eta = 1, .flags = kDeltaReflection};
    const float scale = mode_ == TransportMode::kRadiance ? sqr(f.eta_ti) : 1;
    return {.wi = refract(wo, f.cos_theta_t, f.eta_ti),
            .weight = transmittance_ * scale,
            .pdf = 1 - f.reflectance,
            .eta = f.eta_it,
            .flags = kDeltaTransmission,
            .lobe = 1};
  }
  void lobe_pmfs(const Vec3& wo, float* pmfs) const override {
    pmfs[0] = fresnel_dielectric(wo.z, eta_).reflectance;
    pmfs[1] = 1 - pmfs[0];
  }
};

class PaneClosure final : public SmoothClosure {
 public:
  using SmoothClosure::SmoothClosure;
  static constexpr uint32_t kFlags = kDeltaReflection | kNullTransmission;
  uint32_t flags() const override { return kFlags; }
  BsdfSample sample(const Vec3& wo, float u_lobe, Vec2) const override {
    const float r = reflected(wo);
    if (u_lobe < r) return {.wi = reflect(wo), .weight = reflectance_, .pdf = r, .eta = 1, .flags = kDeltaReflection};
    return {.wi = -wo, .weight = transmittance_, .pdf = 1 - r, .eta = 1, .flags = kNullTransmission, .lobe = 1};
  }
  NullPassage null_passage(const Vec3& wo) const override {
    const float passing = 1 - reflected(wo);
    return {transmittance_ * passing, passing};
  }
  void lobe_pmfs(const Vec3& wo, float* pmfs) const override {
    pmfs[0] = reflected(wo);
    pmfs[1] = 1 - pmfs[0];
  }

 private:
  float reflected(const Vec3& wo) const {
    const float r = fresnel_dielectric(std::abs(wo.z), eta_).reflectance;
    return 2 * r / (1 + r);
  }
};

template <typename Closure>
class Smooth final : public Bsdf {
 public:
  explicit Smooth(Parameters& parameters)
      : eta_(get_relative_ior(parameters, "bk7")),
        reflectance_(parameters, "specular_reflectance", 1),
        transmittance_(parameters, "specular_transmittance", 1) {}

  uint32_t flags() const override { return Closure::kFlags; }
  const BsdfClosure* bind(const SurfaceHit& hit, bool, TransportMode mode, Arena& arena) const override {
    return arena.make<Closure>(eta_, mode, reflectance_.eval(hit), transmittance_.eval(hit));
  }
  /// The brighter of the two factors.
  Spectrum albedo(const SurfaceHit& hit) const override {
    const Spectrum r = reflectance_.eval(hit), t = transmittance_.eval(hit);
    return clamp01(luminance(r) > luminance(t) ? r : t);
  }

 private:
  float eta_;
  ColourInput reflectance_, transmittance_;
};

}  // namespace

std::shared_ptr<Bsdf> make_dielectric(Parameters& parameters) {
  return std::make_shared<Smooth<DielectricClosure>>(parameters);
}

std::shared_ptr<Bsdf> make_thindielectric(Parameters& parameters) {
  return std::make_shared<Smooth<PaneClosure>>(parameters);
}

}  // namespace covary
