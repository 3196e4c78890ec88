// SPDX-License-Identifier: Apache-2.0
// dielectric: a perfectly smooth interface between two transparent media, e.g. glass and air; mirror reflection and
// refraction from both sides. The interior is the side the normal points away from.
//
// | name                   | type           | default | meaning                                           |
// |------------------------|----------------|---------|---------------------------------------------------|
// | int_ior                | number/string  | bk7     | index of refraction inside, or a material's name  |
// | ext_ior                | number/string  | air     | the same outside                                  |
// | specular_reflectance   | colour/texture | 1       | factor on the reflection; not physical unless 1   |
// | specular_transmittance | colour/texture | 1       | factor on the refraction; not physical unless 1   |
//
// Reflection is chosen with the Fresnel reflectance as probability. Refracted radiance is scaled by the squared ratio
// of indices (Veach 1997, Section 5.2), importance not.
#include "bsdfs/fresnel.h"
#include "bsdfs/inputs.h"
#include "bsdfs/registry.h"

namespace covary {
namespace {

class DielectricClosure final : public BsdfClosure {
 public:
  DielectricClosure(float eta, TransportMode mode, const Spectrum& reflectance, const Spectrum& transmittance)
      : eta_(eta), mode_(mode), reflectance_(reflectance), transmittance_(transmittance) {}

  uint32_t flags() const override { return kDeltaReflection | kDeltaTransmission; }
  BsdfValue eval(const Vec3&, const Vec3&) const override { return {}; }
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
  int n_lobes() const override { return 2; }
  void lobe_pmfs(const Vec3& wo, float* pmfs) const override {
    pmfs[0] = fresnel_dielectric(wo.z, eta_).reflectance;
    pmfs[1] = 1 - pmfs[0];
  }
  void lobe_pdfs(const Vec3&, const Vec3&, float* pdfs) const override { pdfs[0] = pdfs[1] = 0; }

 private:
  float eta_;
  TransportMode mode_;
  Spectrum reflectance_, transmittance_;
};

class Dielectric final : public Bsdf {
 public:
  Dielectric(float eta, ColourInput reflectance, ColourInput transmittance)
      : eta_(eta), reflectance_(std::move(reflectance)), transmittance_(std::move(transmittance)) {}

  uint32_t flags() const override { return kDeltaReflection | kDeltaTransmission; }
  const BsdfClosure* bind(const SurfaceHit& hit, bool, TransportMode mode, Arena& arena) const override {
    return arena.make<DielectricClosure>(eta_, mode, reflectance_.eval(hit), transmittance_.eval(hit));
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
  const float eta = get_relative_ior(parameters, "bk7");
  return std::make_shared<Dielectric>(eta, ColourInput(parameters.get_texture("specular_reflectance", Spectrum(1))),
                                      ColourInput(parameters.get_texture("specular_transmittance", Spectrum(1))));
}

}  // namespace covary
