// SPDX-License-Identifier: Apache-2.0
// principledthin: the thin-surface variant of `principled` ([Burley2015]), for leaves, paper, curtains and panes
// modelled as a single sheet. Both sides look alike; transmission is not refracted.
//
// | name                                 | type           | default | meaning                                         |
// |--------------------------------------|----------------|---------|-------------------------------------------------|
// | base_color                           | colour/texture | 0.5     | colour of all but untinted reflection           |
// | roughness                            | number/texture | 0.5     | GGX alpha is its square, at least 0.001         |
// | anisotropic                          | number/texture | 0       | stretches highlights along dp/du                |
// | spec_trans                           | number/texture | 0       | blends diffuse and specular parts               |
// | eta                                  | number/texture | 1.5     | relative index of refraction                    |
// | spec_tint                            | number/texture | 0       | tints specular reflection by base_color         |
// | sheen, sheen_tint                    | number/texture | 0       | grazing reflection of cloth, and its tint       |
// | flatness                             | number/texture | 0       | blends diffuse and subsurface appearance        |
// | diff_trans                           | number/texture | 0       | diffuse transmission; 1: half, 2: all of it     |
// | specular_reflectance_sampling_rate   | number         | 1       | factors on the probability that a lobe is       |
// | specular_transmittance_sampling_rate | number         | 1       |   sampled; they change noise, never the value   |
// | diffuse_reflectance_sampling_rate    | number         | 1       |                                                 |
// | diffuse_transmittance_sampling_rate  | number         | 1       |                                                 |
//
// Lobes: 0 specular reflection, 1 specular transmission (a reflection mirrored about the surface, its roughness scaled
// by 0.65 eta - 0.35, [Burley2015] section 5.3), 2 diffuse reflection and sheen, 3 diffuse transmission.
#include "bsdfs/principled_terms.h"
#include "bsdfs/registry.h"
#include "core/warp.h"

namespace covary {
namespace {

/// The parameters, either as inputs or evaluated at a point.
template <typename Colour, typename Number>
struct ThinParameters {
  Colour base_color;
  Number roughness, anisotropic, spec_trans, eta, spec_tint, sheen, sheen_tint, flatness, diff_trans;
};
using ThinInputs = ThinParameters<ColourInput, NumberInput>;
using ThinPoint = ThinParameters<Spectrum, float>;

struct ThinRates {
  float specular_reflection, specular_transmission, diffuse_reflection, diffuse_transmission;
};

class ThinClosure final : public BsdfClosure {
 public:
  ThinClosure(const ThinPoint& p, const ThinRates& rates, TransportMode mode)
      : reflection_(principled_distribution(p.roughness, p.anisotropic)),
        transmission_(principled_distribution((0.65f * p.eta - 0.35f) * p.roughness, p.anisotropic)),
        rates_(rates),
        eta_(p.eta),
        roughness_(p.roughness),
        flatness_(p.flatness),
        specular_(p.spec_trans),
        spec_tint_(p.spec_tint),
        specular_transmission_(p.base_color * p.spec_trans),
        mode_(mode) {
    const float reflected = (1 - p.spec_trans) * (1 - 0.5f * p.diff_trans);
    diffuse_reflection_ = p.base_color * (reflected * kInvPi);
    diffuse_transmission_ = p.base_color * ((1 - p.spec_trans) * 0.5f * p.diff_trans * kInvPi);
    tinted_r0_ = principled_tint(p.base_color) * schlick_r0(p.eta);
    if (p.sheen > 0) sheen_ = lerp(p.sheen_tint, Spectrum(1), principled_tint(p.base_color)) * (p.sheen * reflected);
  }

  uint32_t flags() const override {
    return kDiffuseReflection | (is_black(diffuse_transmission_) ? 0u : uint32_t{kDiffuseTransmission}) |
           (specular_ > 0 ? kGlossyReflection | kGlossyTransmission : 0u);
  }
  BsdfValue eval(const Vec3& wo, const Vec3& wi) const override {
    if (wo.z == 0) return {};
    const Vec3 o = wo.z > 0 ? wo : -wo;
    float pmf[kLobes];
    probabilities(o, pmf);
    const Terms t = terms(o, wo.z > 0 ? wi : -wi, mode_);
    return {t.value, t.mixture(pmf)};
  }
  BsdfSample sample(const Vec3& wo, float u_lobe, Vec2 u) const override {
    static constexpr uint32_t kFlags[] = {kGlossyReflection, kGlossyTransmission, kDiffuseReflection,
                                          kDiffuseTransmission};
    if (wo.z == 0) return {};
    const Vec3 o = wo.z > 0 ? wo : -wo;
    float pmf[kLobes];
    probabilities(o, pmf);
    uint32_t lobe = 0;
    for (float bound = pmf[0]; lobe < kDiffuseTransmit && u_lobe >= bound; bound += pmf[++lobe]) {
    }
    while (lobe > 0 && pmf[lobe] == 0) --lobe;  // rounding past the last active lobe
    Vec3 i = lobe == kReflect    ? reflect(o, reflection_.sample(o, u).m)
             : lobe == kTransmit ? reflect(o, transmission_.sample(o, u).m)
                                 : warp::square_to_cosine_hemisphere(u);
    if (!(i.z > 0)) return {};
    if (lobe == kTransmit || lobe == kDiffuseTransmit) i.z = -i.z;
    const Terms t = terms(o, i, mode_);
    const float pdf = t.mixture(pmf);
    if (!(t.pdf[lobe] > 0 && pdf > 0)) return {};
    return {
        .wi = wo.z > 0 ? i : -i, .weight = t.value / pdf, .pdf = pdf, .eta = 1, .flags = kFlags[lobe], .lobe = lobe};
  }
  int n_lobes() const override { return kLobes; }
  void lobe_pmfs(const Vec3& wo, float* pmfs) const override {
    if (wo.z == 0)
      std::fill_n(pmfs, kLobes, 0.0f);
    else
      probabilities(wo.z > 0 ? wo : -wo, pmfs);
  }
  void lobe_pdfs(const Vec3& wo, const Vec3& wi, float* pdfs) const override {
    const Terms t = wo.z == 0 ? Terms{} : terms(wo.z > 0 ? wo : -wo, wo.z > 0 ? wi : -wi, mode_);
    std::copy_n(t.pdf, kLobes, pdfs);
  }
  float reverse_pdf(const Vec3& wo, const Vec3& wi) const override {
    if (wi.z == 0) return 0;
    const Vec3 o = wi.z > 0 ? wi : -wi;
    float pmf[kLobes];
    probabilities(o, pmf);
    const bool radiance = mode_ == TransportMode::kRadiance;
    return terms(o, wi.z > 0 ? wo : -wo, radiance ? TransportMode::kImportance : TransportMode::kRadiance).mixture(pmf);
  }

 private:
  enum Lobe : uint32_t { kReflect, kTransmit, kDiffuseReflect, kDiffuseTransmit, kLobes };

  struct Terms {
    Spectrum value;
    float pdf[kLobes] = {0, 0, 0, 0};
    float mixture(const float* pmf) const {
      return pmf[0] * pdf[0] + pmf[1] * pdf[1] + pmf[2] * pdf[2] + pmf[3] * pdf[3];
    }
  };

  /// Normalised estimates of each lobe's albedo. The Fresnel term is kept away from 0 and 1, because that of tilted
  /// microfacets differs.
  void probabilities(const Vec3& o, float* pmf) const {
    float f = 0;
    if (specular_ > 0) f = std::clamp(fresnel_dielectric(o.z, eta_).reflectance, 0.1f, 0.9f);
    pmf[0] = rates_.specular_reflection * specular_ * f;
    pmf[1] = rates_.specular_transmission * mean(specular_transmission_) * (1 - f);
    pmf[2] = rates_.diffuse_reflection * (mean(diffuse_reflection_) * kPi + 0.1f * mean(sheen_));
    pmf[3] = rates_.diffuse_transmission * mean(diffuse_transmission_) * kPi;
    const float sum = pmf[0] + pmf[1] + pmf[2] + pmf[3];
    for (uint32_t l = 0; l < kLobes; ++l) pmf[l] = sum > 0 ? pmf[l] / sum : 0;
  }

  /// Value and densities of the lobes; `o` and `i` as seen from the side of wo.
  Terms terms(const Vec3& o, const Vec3& i, TransportMode mode) const {
    Terms t;
    if (i.z > 0) {
      const Vec3 h = normalize(o + i);
      const float c = dot(o, h);
      if (specular_ > 0) {
        const float visible = 0.25f * reflection_.eval(h) * reflection_.smith_g1_over_cos(o);
        t.pdf[0] = visible;
        t.value = reflectance(c) * (specular_ * visible * reflection_.smith_g1(i));
      }
      t.value +=
          (diffuse_reflection_ * principled_diffuse(o.z, i.z, c, roughness_, flatness_) + sheen_ * schlick_weight(c)) *
          i.z;
      t.pdf[2] = warp::cosine_hemisphere_pdf_solid_angle(i.z);
    } else if (i.z < 0) {
      t.pdf[3] = warp::cosine_hemisphere_pdf_solid_angle(-i.z);
      t.value = diffuse_transmission_ * -i.z;
      if (!(specular_ > 0)) return t;
      const Vec3 h = normalize(o + Vec3{i.x, i.y, -i.z});
      // Only light that also arrives from the far side of the microfacet. Not reciprocal, but scenes rely on it. For
      // importance, o is the light's direction and i the camera's.
      if ((mode == TransportMode::kRadiance ? dot(i, h) : dot({o.x, o.y, -o.z}, h)) >= 0) return t;
      const float visible = 0.25f * transmission_.eval(h) * transmission_.smith_g1_over_cos(o);
      t.pdf[1] = visible;
      t.value += specular_transmission_ *
                 ((1 - fresnel_dielectric(dot(o, h), eta_).reflectance) * visible * transmission_.smith_g1(i));
    }
    return t;
  }
  Spectrum reflectance(float c) const {
    const Spectrum plain(fresnel_dielectric(c, eta_).reflectance);
    return spec_tint_ > 0 ? lerp(spec_tint_, plain, fresnel_schlick(tinted_r0_, c, eta_)) : plain;
  }

  Microfacet reflection_, transmission_;
  ThinRates rates_;
  float eta_, roughness_, flatness_, specular_, spec_tint_;
  Spectrum specular_transmission_, diffuse_reflection_, diffuse_transmission_, tinted_r0_, sheen_;
  TransportMode mode_;
};

class PrincipledThin final : public Bsdf {
 public:
  PrincipledThin(ThinInputs inputs, const ThinRates& rates) : in_(std::move(inputs)), rates_(rates) {
    const auto may_exceed_0 = [](const NumberInput& n) { return !n.is_constant() || n.constant() > 0; };
    anisotropic_ = may_exceed_0(in_.anisotropic);
    flags_ = kDiffuseReflection | (may_exceed_0(in_.diff_trans) ? uint32_t{kDiffuseTransmission} : 0u) |
             (may_exceed_0(in_.spec_trans) ? kGlossyReflection | kGlossyTransmission : 0u);
  }

  uint32_t flags() const override { return flags_; }
  const BsdfClosure* bind(const SurfaceHit& hit, bool, TransportMode mode, Arena& arena) const override {
    const auto number = [&](const NumberInput& n) { return clamp01(n.eval(hit)); };
    const ThinPoint point{in_.base_color.eval(hit),
                          number(in_.roughness),
                          number(in_.anisotropic),
                          number(in_.spec_trans),
                          std::max(in_.eta.eval(hit), 0.01f),
                          number(in_.spec_tint),
                          number(in_.sheen),
                          number(in_.sheen_tint),
                          number(in_.flatness),
                          std::clamp(in_.diff_trans.eval(hit), 0.0f, 2.0f)};
    return arena.make<ThinClosure>(point, rates_, mode);
  }
  bool needs_derivatives() const override { return anisotropic_; }
  Spectrum albedo(const SurfaceHit& hit) const override { return clamp01(in_.base_color.eval(hit)); }

 private:
  ThinInputs in_;
  ThinRates rates_;
  uint32_t flags_;
  bool anisotropic_;
};

}  // namespace

std::shared_ptr<Bsdf> make_principledthin(Parameters& parameters) {
  const auto fraction = [&](const char* name, float fallback = 0) { return get_fraction(parameters, name, fallback); };
  ThinInputs in{ColourInput(parameters, "base_color", 0.5f),
                fraction("roughness", 0.5f),
                fraction("anisotropic"),
                fraction("spec_trans"),
                NumberInput(parameters.get_texture("eta", 1.5f)),
                fraction("spec_tint"),
                fraction("sheen"),
                fraction("sheen_tint"),
                fraction("flatness"),
                get_fraction(parameters, "diff_trans", 0, 2)};
  if (in.eta.is_constant() && !(in.eta.constant() >= 0.01f && in.eta.constant() <= 100))
    parameters.error_at("eta", fmt::format("is {}; expected a number in [0.01, 100]", in.eta.constant()));
  const auto rate = [&](const char* name) { return parameters.get_float(name, 1, 0, 1e6f); };
  const ThinRates rates{rate("specular_reflectance_sampling_rate"), rate("specular_transmittance_sampling_rate"),
                        rate("diffuse_reflectance_sampling_rate"), rate("diffuse_transmittance_sampling_rate")};
  return std::make_shared<PrincipledThin>(std::move(in), rates);
}

}  // namespace covary
