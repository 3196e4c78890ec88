// SPDX-License-Identifier: Apache-2.0
// roughconductor: a metal with a rough surface, on the side of the normal; black from the other side (Walter et al.
// 2007, "Microfacet Models for Refraction through Rough Surfaces").
//
// | name                 | type           | default | meaning                                                        |
// |----------------------|----------------|---------|----------------------------------------------------------------|
// | material             | string         | none    | a measured metal (conductor_presets.cpp); none: no Fresnel     |
// | eta, k               | colour/texture | 0, 1    | complex index of refraction eta + i k, instead of `material`   |
// | specular_reflectance | colour/texture | 1       | factor on the reflection; not physical unless 1                |
// | distribution, alpha, alpha_u, alpha_v, sample_visible   | | see roughness.h                                      |
#include "bsdfs/fresnel.h"
#include "bsdfs/registry.h"
#include "bsdfs/roughness.h"

namespace covary {
namespace {

class RoughConductorClosure final : public BsdfClosure {
 public:
  RoughConductorClosure(const RoughSurface& surface, const Spectrum& eta, const Spectrum& k, const Spectrum& scale)
      : surface_(surface), eta_(eta), k_(k), scale_(scale) {}

  uint32_t flags() const override { return kGlossyReflection; }
  BsdfValue eval(const Vec3& wo, const Vec3& wi) const override {
    if (!(wo.z > 0 && wi.z > 0)) return {};
    const Vec3 m = normalize(wo + wi);
    const float om = dot(wo, m);
    const Microfacet& normals = surface_.normals;
    // [Walter2007] Eq. (20): f = F D G / (4 cos(theta_o) cos(theta_i)), times cos(theta_i).
    const float d_g1 = normals.eval(m) * normals.smith_g1(wo, m) / (4 * wo.z);
    if (d_g1 == 0) return {};
    const float pdf = surface_.sample_visible ? d_g1 : surface_.pdf(wo, m) / (4 * om);
    return {scale_ * fresnel_conductor(om, eta_, k_) * (d_g1 * normals.smith_g1(wi, m)), pdf};
  }
  BsdfSample sample(const Vec3& wo, float, Vec2 u) const override {
    if (!(wo.z > 0)) return {};
    const auto [m, pdf_m] = surface_.sample(wo, u);
    const float om = dot(wo, m);
    const Vec3 wi = reflect(wo, m);
    if (!(pdf_m > 0 && om > 0 && wi.z > 0)) return {};
    return {.wi = wi,
            .weight = scale_ * fresnel_conductor(om, eta_, k_) * surface_.weight(wo, wi, m),
            .pdf = pdf_m / (4 * om),  // [Walter2007] Eq. (14)
            .eta = 1,
            .flags = kGlossyReflection};
  }
  int n_lobes() const override { return 1; }
  void lobe_pmfs(const Vec3& wo, float* pmfs) const override { pmfs[0] = wo.z > 0 ? 1 : 0; }
  void lobe_pdfs(const Vec3& wo, const Vec3& wi, float* pdfs) const override {
    pdfs[0] = 0;
    if (!(wo.z > 0 && wi.z > 0)) return;
    const Vec3 m = normalize(wo + wi);
    pdfs[0] = surface_.pdf(wo, m) / (4 * dot(wo, m));
  }

 private:
  RoughSurface surface_;
  Spectrum eta_, k_, scale_;
};

class RoughConductor final : public Bsdf {
 public:
  explicit RoughConductor(Parameters& p)
      : roughness_(get_roughness(p)), index_(get_conductor(p)), scale_(p, "specular_reflectance", 1) {}

  uint32_t flags() const override { return kGlossyReflection; }
  const BsdfClosure* bind(const SurfaceHit& hit, bool, TransportMode, Arena& arena) const override {
    return arena.make<RoughConductorClosure>(roughness_.eval(hit), index_.eta.eval(hit), index_.k.eval(hit),
                                             scale_.eval(hit));
  }
  bool needs_derivatives() const override { return roughness_.anisotropic; }
  /// Reflectance at normal incidence.
  Spectrum albedo(const SurfaceHit& hit) const override {
    return clamp01(scale_.eval(hit) * fresnel_conductor(1, index_.eta.eval(hit), index_.k.eval(hit)));
  }

 private:
  RoughnessInput roughness_;
  ConductorInput index_;
  ColourInput scale_;
};

}  // namespace

std::shared_ptr<Bsdf> make_roughconductor(Parameters& parameters) {
  return std::make_shared<RoughConductor>(parameters);
}

}  // namespace covary
