// SPDX-License-Identifier: Apache-2.0
// roughdielectric: a rough interface between two transparent media, e.g. frosted glass; reflection and refraction from
// both sides (Walter et al. 2007, "Microfacet Models for Refraction through Rough Surfaces"). The interior is the side
// the normal points away from.
//
// | name                   | type           | default | meaning                                           |
// |------------------------|----------------|---------|---------------------------------------------------|
// | int_ior                | number/string  | bk7     | index of refraction inside, or a material's name  |
// | ext_ior                | number/string  | air     | the same outside; must differ from int_ior        |
// | specular_reflectance   | colour/texture | 1       | factor on the reflection; not physical unless 1   |
// | specular_transmittance | colour/texture | 1       | factor on the refraction; not physical unless 1   |
// | distribution, alpha, alpha_u, alpha_v, sample_visible   | | see roughness.h                         |
//
// A normal m is sampled, then reflection is chosen with the Fresnel reflectance at m. That probability depends on m,
// not on wo alone, so reflection and refraction are one lobe with one density over the whole sphere.
#include "bsdfs/fresnel.h"
#include "bsdfs/registry.h"
#include "bsdfs/roughness.h"

namespace covary {
namespace {

constexpr uint32_t kFlags = kGlossyReflection | kGlossyTransmission;

class RoughDielectricClosure final : public BsdfClosure {
 public:
  RoughDielectricClosure(const RoughSurface& surface, float eta, TransportMode mode, const Spectrum& reflectance,
                         const Spectrum& transmittance)
      : surface_(surface), eta_(eta), mode_(mode), reflectance_(reflectance), transmittance_(transmittance) {}

  uint32_t flags() const override { return kFlags; }
  BsdfValue eval(const Vec3& wo, const Vec3& wi) const override {
    if (wo.z == 0 || wi.z == 0) return {};
    const bool reflects = wo.z * wi.z > 0;
    const float eta = wo.z > 0 ? eta_ : 1 / eta_;  // of the side of wi over that of wo, if it transmits
    // Half vector, [Walter2007] Eqs. (13) and (16), flipped to the side of the surface normal.
    Vec3 m = normalize(reflects ? wo + wi : wo + wi * eta);
    if (m.z < 0) m = -m;
    const float om = dot(wo, m), im = dot(wi, m);
    if (!(om * wo.z > 0 && im * wi.z > 0)) return {};
    const Microfacet& normals = surface_.normals;
    const float d = normals.eval(m);
    if (d == 0) return {};
    const float fresnel = fresnel_dielectric(om, eta_).reflectance;
    const float d_g = d * normals.smith_g(wo, wi, m);
    const float pdf_m = sampling_surface(wo).pdf(upwards(wo), m);
    if (reflects)  // [Walter2007] Eqs. (20) and (14)
      return {reflectance_ * (fresnel * d_g / (4 * std::abs(wo.z))), fresnel * pdf_m / (4 * std::abs(im))};
    const float jacobian = sqr(eta) * std::abs(im) / sqr(om + eta * im);  // [Walter2007] Eq. (17)
    const float scale = mode_ == TransportMode::kRadiance ? 1 / sqr(eta) : 1;
    return {transmittance_ * (scale * (1 - fresnel) * d_g * jacobian * std::abs(om / wo.z)),  // Eq. (21)
            (1 - fresnel) * pdf_m * jacobian};
  }
  BsdfSample sample(const Vec3& wo, float u_lobe, Vec2 u) const override {
    if (wo.z == 0) return {};
    const auto [m, pdf_m] = sampling_surface(wo).sample(upwards(wo), u);
    const float om = dot(wo, m);
    if (!(pdf_m > 0 && om * wo.z > 0)) return {};
    const DielectricFresnel f = fresnel_dielectric(om, eta_);
    BsdfSample s;
    if (u_lobe < f.reflectance) {
      s.wi = reflect(wo, m);
      if (!(s.wi.z * wo.z > 0)) return {};
      s.pdf = f.reflectance * pdf_m / (4 * std::abs(om));
      s.weight = reflectance_;
      s.flags = kGlossyReflection;
    } else {
      s.wi = refract(wo, m, f.cos_theta_t, f.eta_ti);
      const float im = dot(s.wi, m);
      if (!(s.wi.z * wo.z < 0 && im * s.wi.z > 0)) return {};
      s.pdf = (1 - f.reflectance) * pdf_m * sqr(f.eta_it) * std::abs(im) / sqr(om + f.eta_it * im);
      s.weight = mode_ == TransportMode::kRadiance ? transmittance_ * sqr(f.eta_ti) : transmittance_;
      s.eta = f.eta_it;
      s.flags = kGlossyTransmission;
    }
    s.weight *= sampling_weight(wo, s.wi, m, pdf_m);
    return s;
  }
  int n_lobes() const override { return 1; }
  void lobe_pmfs(const Vec3& wo, float* pmfs) const override { pmfs[0] = wo.z != 0 ? 1 : 0; }
  void lobe_pdfs(const Vec3& wo, const Vec3& wi, float* pdfs) const override { pdfs[0] = eval(wo, wi).pdf_solid_angle; }

 private:
  static Vec3 upwards(const Vec3& w) { return w.z < 0 ? -w : w; }
  /// When all normals are sampled, a slightly rougher surface keeps weights bounded ([Walter2007] Section 5.3).
  RoughSurface sampling_surface(const Vec3& wo) const {
    return surface_.sample_visible ? surface_ : surface_.scaled(1.2f - 0.2f * std::sqrt(std::abs(wo.z)));
  }
  float sampling_weight(const Vec3& wo, const Vec3& wi, const Vec3& m, float pdf_m) const {
    if (surface_.sample_visible) return surface_.weight(wo, wi, m);
    return surface_.normals.eval(m) * surface_.normals.smith_g(wo, wi, m) * std::abs(dot(wo, m) / wo.z) / pdf_m;
  }

  RoughSurface surface_;
  float eta_;
  TransportMode mode_;
  Spectrum reflectance_, transmittance_;
};

class RoughDielectric final : public Bsdf {
 public:
  explicit RoughDielectric(Parameters& p)
      : roughness_(get_roughness(p)),
        eta_(get_relative_ior(p, "bk7")),
        reflectance_(p, "specular_reflectance", 1),
        transmittance_(p, "specular_transmittance", 1) {
    if (eta_ == 1) p.error("'int_ior' and 'ext_ior' are equal; they must differ");
  }

  uint32_t flags() const override { return kFlags; }
  const BsdfClosure* bind(const SurfaceHit& hit, bool, TransportMode mode, Arena& arena) const override {
    return arena.make<RoughDielectricClosure>(roughness_.eval(hit), eta_, mode, reflectance_.eval(hit),
                                              transmittance_.eval(hit));
  }
  bool needs_derivatives() const override { return roughness_.anisotropic; }
  /// The brighter of the two factors.
  Spectrum albedo(const SurfaceHit& hit) const override {
    const Spectrum r = reflectance_.eval(hit), t = transmittance_.eval(hit);
    return clamp01(luminance(r) > luminance(t) ? r : t);
  }

 private:
  RoughnessInput roughness_;
  float eta_;
  ColourInput reflectance_, transmittance_;
};

}  // namespace

std::shared_ptr<Bsdf> make_roughdielectric(Parameters& parameters) {
  return std::make_shared<RoughDielectric>(parameters);
}

}  // namespace covary
