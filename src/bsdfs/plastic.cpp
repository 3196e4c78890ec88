// SPDX-License-Identifier: Apache-2.0
// plastic: a diffuse base under a smooth dielectric coating, on the side of the normal; black from the other side.
//
// | name                 | type           | default       | meaning                                                 |
// |----------------------|----------------|---------------|---------------------------------------------------------|
// | diffuse_reflectance  | colour/texture | 0.5           | reflectance of the base                                 |
// | nonlinear            | bool           | false         | colour shift by multiple scattering inside the coating  |
// | int_ior              | number/string  | polypropylene | index of refraction of the coating                      |
// | ext_ior              | number/string  | air           | index of refraction outside                             |
// | specular_reflectance | colour/texture | 1             | factor on the mirror reflection; not physical unless 1  |
//
// The fraction of light that enters, 1 - F(wi), scatters at the base and leaves with 1 - F(wo), or is reflected back
// inside with the mean internal reflectance Fi and scatters again. Summing the bounces (a geometric series):
//     f_diffuse = (1 - F(wi)) (1 - F(wo)) rho / (pi eta^2 (1 - rho Fi))
// Without `nonlinear` the denominator has Fi in place of rho Fi, which preserves the hue of textures.
#include "bsdfs/coated.h"
#include "bsdfs/fresnel.h"
#include "bsdfs/registry.h"

namespace covary {
namespace {

class PlasticClosure final : public BsdfClosure {
 public:
  /// `base`: rho / (eta^2 (1 - rho Fi)).
  PlasticClosure(float eta, float specular_weight, const Spectrum& base, const Spectrum& specular)
      : eta_(eta), specular_weight_(specular_weight), base_(base), specular_(specular) {}

  uint32_t flags() const override { return kDeltaReflection | kDiffuseReflection; }
  BsdfValue eval(const Vec3& wo, const Vec3& wi) const override {
    if (!(wo.z > 0 && wi.z > 0)) return {};
    const float f_o = fresnel(wo), f_i = fresnel(wi);
    const float cos_pdf = warp::cosine_hemisphere_pdf_solid_angle(wi.z);
    return {base_ * (cos_pdf * (1 - f_i) * (1 - f_o)), cos_pdf * (1 - specular_pmf(f_o))};
  }
  BsdfSample sample(const Vec3& wo, float u_lobe, Vec2 u) const override {
    if (!(wo.z > 0)) return {};
    const float f_o = fresnel(wo), pmf = specular_pmf(f_o);
    if (u_lobe < pmf)
      return {.wi = reflect(wo), .weight = specular_ * (f_o / pmf), .pdf = pmf, .eta = 1, .flags = kDeltaReflection};
    const Vec3 wi = warp::square_to_cosine_hemisphere(u);
    const float pdf = warp::cosine_hemisphere_pdf_solid_angle(wi.z) * (1 - pmf);
    if (!(pdf > 0)) return {};
    return {.wi = wi,
            .weight = base_ * ((1 - fresnel(wi)) * (1 - f_o) / (1 - pmf)),
            .pdf = pdf,
            .eta = 1,
            .flags = kDiffuseReflection,
            .lobe = 1};
  }
  int n_lobes() const override { return 2; }
  void lobe_pmfs(const Vec3& wo, float* pmfs) const override {
    pmfs[0] = wo.z > 0 ? specular_pmf(fresnel(wo)) : 0;
    pmfs[1] = wo.z > 0 ? 1 - pmfs[0] : 0;
  }
  void lobe_pdfs(const Vec3& wo, const Vec3& wi, float* pdfs) const override {
    pdfs[0] = 0;
    pdfs[1] = wo.z > 0 ? warp::cosine_hemisphere_pdf_solid_angle(wi.z) : 0;
  }

 private:
  float fresnel(const Vec3& w) const { return fresnel_dielectric(w.z, eta_).reflectance; }
  /// Probability of the mirror lobe, from the Fresnel reflectance and mean colours.
  float specular_pmf(float f_o) const {
    const float specular = f_o * specular_weight_, diffuse = (1 - f_o) * (1 - specular_weight_);
    return specular + diffuse > 0 ? specular / (specular + diffuse) : 1;
  }

  float eta_, specular_weight_;
  Spectrum base_, specular_;
};

class Plastic final : public CoatedBsdf {
 public:
  explicit Plastic(Parameters& p)
      : CoatedBsdf(p),
        eta_(get_relative_ior(p, "polypropylene")),
        internal_reflectance_(fresnel_diffuse_reflectance(1 / eta_)),
        nonlinear_(p.get_bool("nonlinear", false)) {}

  uint32_t flags() const override { return kDeltaReflection | kDiffuseReflection; }
  const BsdfClosure* bind(const SurfaceHit& hit, bool, TransportMode, Arena& arena) const override {
    const Spectrum rho = diffuse_.eval(hit);
    const Spectrum trapped = nonlinear_ ? rho * internal_reflectance_ : Spectrum(internal_reflectance_);
    const Spectrum base = rho / ((Spectrum(1) - trapped) * sqr(eta_));
    return arena.make<PlasticClosure>(eta_, specular_weight_, base, specular_.eval(hit));
  }

 private:
  float eta_, internal_reflectance_;
  bool nonlinear_;
};

}  // namespace

std::shared_ptr<Bsdf> make_plastic(Parameters& parameters) { return std::make_shared<Plastic>(parameters); }

}  // namespace covary
