// SPDX-License-Identifier: Apache-2.0
// pplastic: the plastic of Baek et al. 2018 for unpolarised light: dielectric microfacets above a diffuse base, on the
// side of the normal; black from the other side.
//
// | name                 | type           | default       | meaning                                             |
// |----------------------|----------------|---------------|-----------------------------------------------------|
// | diffuse_reflectance  | colour/texture | 0.5           | reflectance of the base                             |
// | int_ior              | number/string  | polypropylene | index of refraction of the coating                  |
// | ext_ior              | number/string  | air           | index of refraction outside                         |
// | eta                  | number         |               | relative index of refraction, instead of both       |
// | specular_reflectance | colour/texture | 1             | factor on the coating's reflection                  |
// | distribution         | string         | beckmann      | distribution of microfacet normals: beckmann or ggx |
// | alpha, alpha_u, alpha_v, sample_visible |  |           | see roughness.h                                     |
//
// f = F D G / (4 cos cos) + rho / pi (1 - F(wo)) (1 - F(wi)), as in Mitsuba's unpolarised variants.
#include "bsdfs/coated.h"
#include "bsdfs/fresnel.h"
#include "bsdfs/registry.h"

namespace covary {
namespace {

class PPlasticClosure final : public CoatedClosure<PPlasticClosure> {
 public:
  PPlasticClosure(const RoughSurface& surface, float eta, float specular_weight, const Spectrum& base,
                  const Spectrum& specular)
      : CoatedClosure(surface), eta_(eta), specular_weight_(specular_weight), base_(base), specular_(specular) {}

  float specular_pmf(float) const { return specular_weight_; }
  BsdfValue eval(const Vec3& wo, const Vec3& wi) const override {
    if (!(wo.z > 0 && wi.z > 0)) return {};
    const Vec3 m = normalize(wo + wi);
    const Microfacet& normals = surface_.normals;
    const float om = dot(wo, m);
    const float coating =
        fresnel_dielectric(om, eta_).reflectance * normals.eval(m) * normals.smith_g(wo, wi, m) / (4 * wo.z);
    const float through = (1 - fresnel_dielectric(wo.z, eta_).reflectance) *
                          (1 - fresnel_dielectric(wi.z, eta_).reflectance) * kInvPi * wi.z;
    return {specular_ * coating + base_ * through,
            specular_weight_ * surface_.pdf(wo, m) / (4 * om) +
                (1 - specular_weight_) * warp::cosine_hemisphere_pdf_solid_angle(wi.z)};
  }

 private:
  float eta_, specular_weight_;
  Spectrum base_, specular_;
};

class PPlastic final : public CoatedBsdf {
 public:
  explicit PPlastic(Parameters& p)
      : CoatedBsdf(p),
        roughness_(get_roughness(p)),
        eta_(p.has("eta") ? p.get_float("eta", 1.5f, 1e-3f, 100) : get_relative_ior(p, "polypropylene")) {
    if (eta_ == 1 && p.has("eta"))
      p.error("'eta' is 1; it must not be");
    else
      check_index(eta_, p);
  }

  uint32_t flags() const override { return kGlossyReflection | kDiffuseReflection; }
  const BsdfClosure* bind(const SurfaceHit& hit, bool, TransportMode, Arena& arena) const override {
    return arena.make<PPlasticClosure>(roughness_.eval(hit), eta_, specular_weight_, diffuse_.eval(hit),
                                       specular_.eval(hit));
  }
  bool needs_derivatives() const override { return roughness_.anisotropic; }

 private:
  RoughnessInput roughness_;
  float eta_;
};

}  // namespace

std::shared_ptr<Bsdf> make_pplastic(Parameters& parameters) { return std::make_shared<PPlastic>(parameters); }

}  // namespace covary
