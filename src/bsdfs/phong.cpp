// SPDX-License-Identifier: Apache-2.0
// phong: the modified Phong model [LafortuneWillems1994], a diffuse part and a lobe around the mirror direction, on the
// side of the normal. From Mitsuba 0.x.
//
// | name                 | type           | default | meaning                                                     |
// |----------------------|----------------|---------|-------------------------------------------------------------|
// | diffuse_reflectance  | colour/texture | 0.5     | kd                                                          |
// | specular_reflectance | colour/texture | 0.2     | ks                                                          |
// | exponent             | number/texture | 30      | n: how narrow the lobe is, not negative                     |
//
// f = kd / pi + ks (n + 2) / (2 pi) cos^n(a), where a is the angle between wi and the mirror direction of wo. Sampling:
// a cosine distribution for the first part, (n + 1) / (2 pi) cos^n(a) for the second.
#include <fmt/format.h>

#include "bsdfs/coated.h"
#include "bsdfs/registry.h"

namespace covary {
namespace {

class PhongClosure final : public BsdfClosure {
 public:
  PhongClosure(const Spectrum& diffuse, const Spectrum& specular, float specular_pmf, float exponent)
      : diffuse_(diffuse), specular_(specular), specular_pmf_(specular_pmf), exponent_(exponent) {}

  uint32_t flags() const override { return kGlossyReflection | kDiffuseReflection; }
  BsdfValue eval(const Vec3& wo, const Vec3& wi) const override {
    if (!(wo.z > 0 && wi.z > 0)) return {};
    const float lobe = power(wo, wi), cosine_pdf = warp::cosine_hemisphere_pdf_solid_angle(wi.z);
    return {diffuse_ * cosine_pdf + specular_ * ((exponent_ + 2) * lobe * wi.z),
            (1 - specular_pmf_) * cosine_pdf + specular_pmf_ * (exponent_ + 1) * lobe};
  }
  BsdfSample sample(const Vec3& wo, float u_lobe, Vec2 u) const override {
    BsdfSample s;  // single return object: copy elision (NRVO)
    if (!(wo.z > 0)) return s;
    if (u_lobe < specular_pmf_) {
      const float cosine = std::pow(u.y, 1 / (exponent_ + 1)), sine = safe_sqrt(1 - cosine * cosine);
      const SinCos phi = sincos_turns(u.x);
      s.wi = Frame(reflect(wo)).to_world({sine * phi.cos, sine * phi.sin, cosine});
      s.flags = kGlossyReflection;
    } else {
      s.wi = warp::square_to_cosine_hemisphere(u);
      s.flags = kDiffuseReflection;
      s.lobe = 1;
    }
    const BsdfValue v = eval(wo, s.wi);
    if (!(v.pdf_solid_angle > 0)) return s;
    s.pdf = v.pdf_solid_angle;
    s.weight = v.value / s.pdf;
    return s;
  }
  int n_lobes() const override { return 2; }
  void lobe_pmfs(const Vec3& wo, float* pmfs) const override {
    pmfs[0] = wo.z > 0 ? specular_pmf_ : 0;
    pmfs[1] = wo.z > 0 ? 1 - specular_pmf_ : 0;
  }
  void lobe_pdfs(const Vec3& wo, const Vec3& wi, float* pdfs) const override {
    const bool above = wo.z > 0 && wi.z > 0;
    pdfs[0] = above ? (exponent_ + 1) * power(wo, wi) : 0;
    pdfs[1] = above ? warp::cosine_hemisphere_pdf_solid_angle(wi.z) : 0;
  }

 private:
  /// cos^n(a) / (2 pi)
  float power(const Vec3& wo, const Vec3& wi) const {
    const float cosine = dot(reflect(wo), wi);
    return cosine > 0 ? std::pow(cosine, exponent_) * (0.5f * kInvPi) : 0;
  }

  Spectrum diffuse_, specular_;
  float specular_pmf_, exponent_;
};

class Phong final : public CoatedBsdf {
 public:
  explicit Phong(Parameters& p)
      : CoatedBsdf(p, 0.2f), exponent_(p.get_texture("exponent", Spectrum(30), SpectrumRole::kIndex)) {
    if (exponent_.is_constant() && !(exponent_.constant() >= 0))
      p.error_at("exponent", fmt::format("is {}; it must not be negative", exponent_.constant()));
  }

  uint32_t flags() const override { return kGlossyReflection | kDiffuseReflection; }
  const BsdfClosure* bind(const SurfaceHit& hit, bool, TransportMode, Arena& arena) const override {
    return arena.make<PhongClosure>(diffuse_.eval(hit), specular_.eval(hit), specular_weight_,
                                    std::max(exponent_.eval(hit), 0.0f));
  }

 private:
  NumberInput exponent_;
};

}  // namespace

std::shared_ptr<Bsdf> make_phong(Parameters& parameters) { return std::make_shared<Phong>(parameters); }

}  // namespace covary
