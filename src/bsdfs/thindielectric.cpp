// SPDX-License-Identifier: Apache-2.0
// thindielectric: a pane of glass as one sheet: mirror reflection, and transmission straight through, from both sides.
//
// | name                   | type           | default | meaning                                           |
// |------------------------|----------------|---------|---------------------------------------------------|
// | int_ior                | number/string  | bk7     | index of refraction of the pane                   |
// | ext_ior                | number/string  | air     | index of refraction around it                     |
// | specular_reflectance   | colour/texture | 1       | factor on the reflection; not physical unless 1   |
// | specular_transmittance | colour/texture | 1       | factor on the transmission; not physical unless 1 |
//
// With reflectance R and transmittance T = 1 - R of one interface the pane reflects
//     R + T R T + T R^3 T + ... = 2 R / (1 + R).
#include "bsdfs/fresnel.h"
#include "bsdfs/inputs.h"
#include "bsdfs/registry.h"

namespace covary {
namespace {

class ThinDielectricClosure final : public BsdfClosure {
 public:
  ThinDielectricClosure(float eta, const Spectrum& reflectance, const Spectrum& transmittance)
      : eta_(eta), reflectance_(reflectance), transmittance_(transmittance) {}

  uint32_t flags() const override { return kDeltaReflection | kNullTransmission; }
  BsdfValue eval(const Vec3&, const Vec3&) const override { return {}; }
  BsdfSample sample(const Vec3& wo, float u_lobe, Vec2) const override {
    const float r = pane_reflectance(wo);
    if (u_lobe < r) return {.wi = reflect(wo), .weight = reflectance_, .pdf = r, .eta = 1, .flags = kDeltaReflection};
    return {.wi = -wo, .weight = transmittance_, .pdf = 1 - r, .eta = 1, .flags = kNullTransmission, .lobe = 1};
  }
  NullPassage null_passage(const Vec3& wo) const override {
    const float passing = 1 - pane_reflectance(wo);
    return {transmittance_ * passing, passing};
  }
  int n_lobes() const override { return 2; }
  void lobe_pmfs(const Vec3& wo, float* pmfs) const override {
    pmfs[0] = pane_reflectance(wo);
    pmfs[1] = 1 - pmfs[0];
  }
  void lobe_pdfs(const Vec3&, const Vec3&, float* pdfs) const override { pdfs[0] = pdfs[1] = 0; }

 private:
  float pane_reflectance(const Vec3& wo) const {
    const float r = fresnel_dielectric(std::abs(wo.z), eta_).reflectance;
    return 2 * r / (1 + r);
  }

  float eta_;
  Spectrum reflectance_, transmittance_;
};

class ThinDielectric final : public Bsdf {
 public:
  ThinDielectric(float eta, ColourInput reflectance, ColourInput transmittance)
      : eta_(eta), reflectance_(std::move(reflectance)), transmittance_(std::move(transmittance)) {}

  uint32_t flags() const override { return kDeltaReflection | kNullTransmission; }
  const BsdfClosure* bind(const SurfaceHit& hit, bool, TransportMode, Arena& arena) const override {
    return arena.make<ThinDielectricClosure>(eta_, reflectance_.eval(hit), transmittance_.eval(hit));
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

std::shared_ptr<Bsdf> make_thindielectric(Parameters& parameters) {
  const float eta = get_relative_ior(parameters, "bk7");
  return std::make_shared<ThinDielectric>(eta, ColourInput(parameters.get_texture("specular_reflectance", Spectrum(1))),
                                          ColourInput(parameters.get_texture("specular_transmittance", Spectrum(1))));
}

}  // namespace covary
