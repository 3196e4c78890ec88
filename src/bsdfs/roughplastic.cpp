// SPDX-License-Identifier: Apache-2.0
// roughplastic: a diffuse base under a rough dielectric coating, on the side of the normal; black from the other side.
//
// | name                 | type           | default       | meaning                                                |
// |----------------------|----------------|---------------|--------------------------------------------------------|
// | diffuse_reflectance  | colour/texture | 0.5           | reflectance of the base                                |
// | nonlinear            | bool           | false         | colour shift by multiple scattering inside the coating |
// | int_ior              | number/string  | polypropylene | index of refraction of the coating                     |
// | ext_ior              | number/string  | air           | index of refraction outside; must differ from int_ior  |
// | specular_reflectance | colour/texture | 1             | factor on the coating's reflection                     |
// | distribution         | string         | beckmann      | distribution of microfacet normals: beckmann or ggx    |
// | alpha, alpha_u, alpha_v, sample_visible |  |            | see roughness.h                                        |
//
// Like plastic.cpp, with the transmittance T of the rough interface in place of 1 - F:
//     f_diffuse = T(wi) T(wo) rho / (pi eta^2 (1 - rho Ri)).
// T(cos) and the mean internal reflectance Ri are those of rough_transmittance.h; where alpha varies, or differs along
// u and v, of the nearest of 16 isotropic interfaces.
#include "bsdfs/coated.h"
#include "bsdfs/fresnel.h"
#include "bsdfs/registry.h"
#include "bsdfs/rough_transmittance.h"

namespace covary {
namespace {

class RoughPlasticClosure final : public CoatedClosure<RoughPlasticClosure> {
 public:
  /// `base`: rho / (pi eta^2 (1 - rho Ri)).
  RoughPlasticClosure(const RoughSurface& surface, const RoughTransmittance& transmittance, float eta,
                      float specular_weight, const Spectrum& base, const Spectrum& specular)
      : CoatedClosure(surface),
        transmittance_(transmittance),
        eta_(eta),
        specular_weight_(specular_weight),
        base_(base),
        specular_(specular) {}

  /// From the coating's directional reflectance and the mean colours.
  float specular_pmf(float cos_o) const { return specular_pmf_of(transmittance_(cos_o)); }
  BsdfValue eval(const Vec3& wo, const Vec3& wi) const override {
    if (!(wo.z > 0 && wi.z > 0)) return {};
    const Vec3 m = normalize(wo + wi);
    const Microfacet& normals = surface_.normals;
    const float om = dot(wo, m), t_o = transmittance_(wo.z), pmf = specular_pmf_of(t_o);
    const float d_g1 = normals.eval(m) * normals.smith_g1(wo, m) / (4 * wo.z);
    const float coating = fresnel_dielectric(om, eta_).reflectance * d_g1 * normals.smith_g1(wi, m);
    const float pdf = surface_.sample_visible ? d_g1 : surface_.pdf(wo, m) / (4 * om);
    return {specular_ * coating + base_ * (wi.z * t_o * transmittance_(wi.z)),
            pmf * pdf + (1 - pmf) * warp::cosine_hemisphere_pdf_solid_angle(wi.z)};
  }

 private:
  float specular_pmf_of(float t_o) const {
    const float specular = (1 - t_o) * specular_weight_, diffuse = t_o * (1 - specular_weight_);
    return specular + diffuse > 0 ? specular / (specular + diffuse) : 1;
  }

  const RoughTransmittance& transmittance_;
  float eta_, specular_weight_;
  Spectrum base_, specular_;
};

class RoughPlastic final : public CoatedBsdf {
 public:
  RoughPlastic(RoughnessInput roughness, Parameters& p)
      : CoatedBsdf(p),
        roughness_(std::move(roughness)),
        varies_(!roughness_.alpha_u.is_constant() || !roughness_.alpha_v.is_constant()),
        surface_(varies_ ? RoughSurface{Microfacet(roughness_.type, 0.1f, 0.1f), true} : roughness_.eval({})),
        eta_(get_relative_ior(p, "polypropylene")),
        nonlinear_(p.get_bool("nonlinear", false)) {
    check_index(eta_, p);
    if (eta_ == 1) return;
    if (!varies_ && !roughness_.anisotropic) {
      tables_ = {shared_transmittance(surface_.normals, eta_)};
      return;
    }
    for (int i = 0; i < kTables; ++i) {
      const float alpha = (static_cast<float>(i) + 0.5f) / kTables;
      tables_.push_back(shared_transmittance(Microfacet(surface_.normals.type(), alpha, alpha), eta_));
    }
  }

  uint32_t flags() const override { return kGlossyReflection | kDiffuseReflection; }
  bool needs_derivatives() const override { return roughness_.anisotropic; }
  const BsdfClosure* bind(const SurfaceHit& hit, bool, TransportMode, Arena& arena) const override {
    const RoughSurface surface = varies_ ? roughness_.eval(hit) : surface_;
    const RoughTransmittance& transmittance = table(surface.normals);
    const Spectrum rho = diffuse_.eval(hit);
    const float internal = transmittance.internal_reflectance();
    const Spectrum trapped = nonlinear_ ? rho * internal : Spectrum(internal);
    const Spectrum base = rho * kInvPi / ((Spectrum(1) - trapped) * sqr(eta_));
    return arena.make<RoughPlasticClosure>(surface, transmittance, eta_, specular_weight_, base, specular_.eval(hit));
  }

 private:
  static constexpr int kTables = 16;

  const RoughTransmittance& table(const Microfacet& normals) const {
    if (tables_.size() == 1) return *tables_[0];
    const float alpha = std::sqrt(normals.alpha_u() * normals.alpha_v());
    return *tables_[static_cast<size_t>(std::clamp(static_cast<int>(alpha * kTables), 0, kTables - 1))];
  }

  RoughnessInput roughness_;
  bool varies_;
  RoughSurface surface_;  // unless it varies
  std::vector<std::shared_ptr<const RoughTransmittance>> tables_;
  float eta_;
  bool nonlinear_;
};

}  // namespace

std::shared_ptr<Bsdf> make_roughplastic(Parameters& parameters) {
  return std::make_shared<RoughPlastic>(get_roughness(parameters), parameters);
}

}  // namespace covary
