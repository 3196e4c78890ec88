// SPDX-License-Identifier: Apache-2.0
// principled: an artist-friendly model for metals, plastics, coated and transmissive materials ([Burley2012] and
// [Burley2015]).
//
// | name                              | type           | default | meaning                                           |
// |-----------------------------------|----------------|---------|---------------------------------------------------|
// | base_color                        | colour/texture | 0.5     | colour of diffuse light, of metal, of refraction  |
// | roughness                         | number/texture | 0.5     | GGX alpha is its square, at least 0.001           |
// | anisotropic                       | number/texture | 0       | stretches highlights along dp/du                  |
// | metallic                          | number/texture | 0       | blends dielectric and metal                       |
// | spec_trans                        | number/texture | 0       | blends diffuse reflection and refraction          |
// | eta                               | number         |         | relative index of refraction, or instead of it:   |
// | specular                          | number         | 0.5     | eta = 2 / (1 - sqrt(0.08 specular)) - 1           |
// | spec_tint                         | number/texture | 0       | tints dielectric reflection by base_color         |
// | sheen, sheen_tint                 | number/texture | 0       | grazing reflection of cloth, and its tint         |
// | flatness                          | number/texture | 0       | blends diffuse and subsurface appearance          |
// | clearcoat                         | number/texture | 0       | second, isotropic highlight                       |
// | clearcoat_gloss                   | number/texture | 0       | 0: satin (alpha 0.1), 1: gloss (alpha 0.001)      |
// | diffuse_reflectance_sampling_rate | number         | 1       | factors on the probability that a lobe is         |
// | main_specular_sampling_rate       | number         | 1       |   sampled; they change noise, never the value     |
// | clearcoat_sampling_rate           | number         | 1       |                                                   |
//
// Numbers are in [0, 1] except eta and the rates. The side opposite the normal is inside the material: it reflects and
// refracts if spec_trans > 0, otherwise it is black. With eta = 1 the main lobe, metal included, reflects nothing, and
// with spec_trans an index of 1 is replaced by 1.001; scenes rely on both.
//
// Lobes: 0 diffuse and sheen (cosine-weighted), 1 clearcoat (GTR1 normals), 2 main specular (visible GGX normals;
// reflection or refraction is chosen by the energy of each at the sampled normal). Lobe probabilities follow estimates
// of each lobe's albedo for wo.
#include "bsdfs/principled_terms.h"
#include "bsdfs/registry.h"
#include "core/warp.h"

namespace covary {
namespace {

/// Generalised Trowbridge-Reitz distribution with exponent 1 ([Burley2012] appendix B.2).
class Gtr1 {
 public:
  explicit Gtr1(float alpha) : alpha2_(sqr(alpha)), scale_((alpha2_ - 1) / (kPi * std::log(alpha2_))) {}
  float eval(const Vec3& m) const { return scale_ / (1 + (alpha2_ - 1) * sqr(m.z)); }
  /// Per unit solid angle of the normal.
  float pdf(const Vec3& m) const { return eval(m) * m.z; }
  Vec3 sample(Vec2 u) const {
    const float cos2 = (1 - std::pow(alpha2_, 1 - u.y)) / (1 - alpha2_);
    const float s = safe_sqrt(1 - cos2);
    const SinCos phi = sincos_turns(u.x);
    return {s * phi.cos, s * phi.sin, safe_sqrt(cos2)};
  }

 private:
  float alpha2_, scale_;
};

/// The parameters, either as inputs or evaluated at a point.
template <typename Colour, typename Number>
struct PrincipledParameters {
  Colour base_color;
  Number roughness, anisotropic, metallic, spec_trans, spec_tint, sheen, sheen_tint, flatness, clearcoat,
      clearcoat_gloss;
};
using PrincipledInputs = PrincipledParameters<ColourInput, NumberInput>;
using PrincipledPoint = PrincipledParameters<Spectrum, float>;

struct PrincipledSettings {
  float eta, diffuse_rate, specular_rate, clearcoat_rate;
};

class PrincipledClosure final : public BsdfClosure {
 public:
  PrincipledClosure(const PrincipledPoint& p, const PrincipledSettings& settings, TransportMode mode)
      : distribution_(principled_distribution(p.roughness, p.anisotropic)),
        clearcoat_distribution_(lerp(p.clearcoat_gloss, 0.1f, 0.001f)),
        eta_(settings.eta),
        roughness_(p.roughness),
        flatness_(p.flatness),
        clearcoat_(0.25f * p.clearcoat),
        refraction_((1 - p.metallic) * p.spec_trans),
        specular_rate_(settings.specular_rate),
        radiance_(mode == TransportMode::kRadiance) {
    const float diffuse = (1 - p.metallic) * (1 - p.spec_trans);
    diffuse_ = p.base_color * (diffuse * kInvPi);
    if (diffuse > 0 && p.sheen > 0)
      sheen_ = lerp(p.sheen_tint, Spectrum(1), principled_tint(p.base_color)) * (p.sheen * (1 - p.metallic));
    // Reflectance F(c) = dielectric F_d(c) + r0 + rise w(c), with Schlick's weight w, blends a dielectric, a metal (r0
    // = base colour) and a tinted dielectric ([Burley2012] section 5.5).
    dielectric_ = (1 - p.metallic) * (1 - p.spec_tint);
    r0_ = p.base_color * p.metallic;
    if (p.spec_tint > 0)
      r0_ = r0_ + principled_tint(p.base_color) * ((1 - p.metallic) * p.spec_tint * schlick_r0(eta_));
    rise_ = Spectrum(1 - dielectric_) - r0_;
    if (refraction_ > 0) refraction_colour_ = sqrt(p.base_color) * refraction_;
    refraction_weight_ = mean(refraction_colour_);
    diffuse_weight_ = settings.diffuse_rate * (mean(diffuse_) * kPi + 0.1f * mean(sheen_));
    clearcoat_weight_ = settings.clearcoat_rate * p.clearcoat;
  }

  uint32_t flags() const override {
    return kDiffuseReflection | kGlossyReflection | (refraction_ > 0 ? uint32_t{kGlossyTransmission} : 0u);
  }
  BsdfValue eval(const Vec3& wo, const Vec3& wi) const override {
    const View view(*this, wo);
    if (!view.active) return {};
    const Terms t = terms(view, view.front ? wi : -wi);
    return {t.value, t.mixture(view)};
  }
  BsdfSample sample(const Vec3& wo, float u_lobe, Vec2 u) const override {
    const View view(*this, wo);
    if (!view.active) return {};
    uint32_t lobe, kind = kGlossyReflection;
    Vec3 i;
    if (u_lobe < view.pmf[kDiffuse]) {
      lobe = kDiffuse, kind = kDiffuseReflection;
      i = warp::square_to_cosine_hemisphere(u);
    } else if (u_lobe < view.pmf[kDiffuse] + view.pmf[kClearcoat]) {
      lobe = kClearcoat;
      i = reflect(view.o, clearcoat_distribution_.sample(u));
    } else if (view.pmf[kSpecular] > 0) {
      lobe = kSpecular;
      const Vec3 m = distribution_.sample(view.o, u).m;
      const float c = dot(view.o, m);
      const DielectricFresnel f = fresnel_dielectric(c, view.eta);
      const float u_rest = (u_lobe - view.pmf[kDiffuse] - view.pmf[kClearcoat]) / view.pmf[kSpecular];
      if (refraction_ == 0 || u_rest < reflection_pmf(specular_reflectance(view, c, f), f)) {
        i = reflect(view.o, m);
      } else {
        kind = kGlossyTransmission;
        i = normalize(refract(view.o, m, f.cos_theta_t, f.eta_ti));
      }
    } else {
      return {};
    }
    // A visible normal may still send the ray to the wrong side of the surface.
    if (!(kind == kGlossyTransmission ? i.z < 0 : i.z > 0)) return {};
    const Terms t = terms(view, i);
    const float pdf = t.mixture(view);
    if (!(t.pdf[lobe] > 0 && pdf > 0)) return {};
    return {.wi = view.front ? i : -i,
            .weight = t.value / pdf,
            .pdf = pdf,
            .eta = i.z > 0 ? 1 : view.eta,
            .flags = kind,
            .lobe = lobe};
  }
  int n_lobes() const override { return kLobes; }
  void lobe_pmfs(const Vec3& wo, float* pmfs) const override { std::copy_n(View(*this, wo).pmf, kLobes, pmfs); }
  void lobe_pdfs(const Vec3& wo, const Vec3& wi, float* pdfs) const override {
    const View view(*this, wo);
    const Terms t = view.active ? terms(view, view.front ? wi : -wi) : Terms{};
    std::copy_n(t.pdf, kLobes, pdfs);
  }

 private:
  enum Lobe : uint32_t { kDiffuse, kClearcoat, kSpecular, kLobes };

  /// Terms that depend on wo alone, as seen from the side of wo: on the back, directions are negated and the index is
  /// inverted.
  struct View {
    View(const PrincipledClosure& closure, const Vec3& wo) : front(wo.z > 0), o(front ? wo : -wo) {
      eta = front ? closure.eta_ : 1 / closure.eta_;
      active = o.z > 0 && (front || closure.refraction_ > 0);
      if (active) closure.lobe_probabilities(*this);
    }
    bool front, active;
    Vec3 o;
    float eta;
    float pmf[kLobes] = {0, 0, 0};
  };
  struct Terms {
    Spectrum value;
    float pdf[kLobes] = {0, 0, 0};
    float mixture(const View& view) const { return view.pmf[0] * pdf[0] + view.pmf[1] * pdf[1] + view.pmf[2] * pdf[2]; }
  };

  void lobe_probabilities(View& view) const {
    if (!view.front) {
      view.pmf[kSpecular] = 1;
      return;
    }
    // Albedo estimates, as for a mirror-like surface.
    const DielectricFresnel f = fresnel_dielectric(view.o.z, eta_);
    const float specular =
        specular_rate_ * (mean(specular_reflectance(view, view.o.z, f)) + refraction_weight_ * (1 - f.reflectance));
    const float clearcoat = clearcoat_weight_ * view.o.z * lerp(schlick(view.o.z, f), 0.04f, 1);
    const float sum = diffuse_weight_ + specular + clearcoat;
    if (!(sum > 0)) return;
    view.pmf[kDiffuse] = diffuse_weight_ / sum;
    view.pmf[kClearcoat] = clearcoat / sum;
    view.pmf[kSpecular] = specular / sum;
  }

  /// Schlick's weight for the angle on the optically thinner side.
  float schlick(float c, const DielectricFresnel& f) const { return schlick_weight(eta_ > 1 ? c : -f.cos_theta_t); }
  /// Microfacet reflectance of the main lobe; `c`: cosine between o and the microfacet normal.
  Spectrum specular_reflectance(const View& view, float c, const DielectricFresnel& f) const {
    if (f.reflectance == 0) return {};  // only for eta = 1
    if (!view.front) return Spectrum(refraction_ * f.reflectance);
    return Spectrum(dielectric_ * f.reflectance) + r0_ + rise_ * schlick(c, f);
  }
  /// Probability of reflection rather than refraction at a sampled normal.
  float reflection_pmf(const Spectrum& reflectance, const DielectricFresnel& f) const {
    const float r = mean(reflectance), t = refraction_weight_ * (1 - f.reflectance);
    return r + t > 0 ? r / (r + t) : 0;
  }

  /// Value and densities of the lobes; both directions as seen from the side of wo.
  Terms terms(const View& view, const Vec3& i) const {
    Terms t;
    if (i.z > 0)
      reflection_terms(view, i, t);
    else if (i.z < 0 && refraction_ > 0)
      refraction_terms(view, i, t);
    return t;
  }
  void reflection_terms(const View& view, const Vec3& i, Terms& t) const {
    const Vec3& o = view.o;
    const Vec3 h = normalize(o + i);
    const float c = dot(o, h);
    const DielectricFresnel f = fresnel_dielectric(c, view.eta);
    // Density of visible normals times dm/di = 1 / (4 c); value after Torrance and Sparrow.
    const float visible = 0.25f * distribution_.eval(h) * distribution_.smith_g1_over_cos(o);
    const Spectrum reflectance = specular_reflectance(view, c, f);
    t.pdf[kSpecular] = visible * (refraction_ == 0 ? 1 : reflection_pmf(reflectance, f));
    t.value = reflectance * (visible * distribution_.smith_g1(i));
    if (!view.front) return;

    if (clearcoat_ > 0) {  // [Burley2012] section 5.4; masking with a fixed alpha of 0.25
      const float d = clearcoat_distribution_.eval(h);
      static const Microfacet kMasking(MicrofacetType::kGgx, 0.25f, 0.25f);
      t.value +=
          Spectrum(clearcoat_ * lerp(schlick(c, f), 0.04f, 1) * d * kMasking.smith_g1(o) * kMasking.smith_g1(i) * i.z);
      t.pdf[kClearcoat] = d * h.z / (4 * c);
    }
    t.value += (diffuse_ * principled_diffuse(o.z, i.z, c, roughness_, flatness_) + sheen_ * schlick_weight(c)) * i.z;
    t.pdf[kDiffuse] = warp::cosine_hemisphere_pdf_solid_angle(i.z);
  }
  void refraction_terms(const View& view, const Vec3& i, Terms& t) const {
    const Vec3& o = view.o;
    Vec3 h = o + i * view.eta;
    const float l2 = length_squared(h);  // (o.m + eta i.m)^2 of the paper
    h *= (h.z > 0 ? 1 : -1) / std::sqrt(l2);
    const float oh = dot(o, h), ih = dot(i, h);
    if (!(oh > 0 && ih < 0)) return;
    const DielectricFresnel f = fresnel_dielectric(oh, view.eta);
    // [Walter2007] Eqs. (17) and (21); radiance is compressed by eta^2.
    const float visible = distribution_.eval(h) * distribution_.smith_g1_over_cos(o) * oh * -ih / l2;
    t.pdf[kSpecular] = visible * sqr(view.eta) * (1 - reflection_pmf(specular_reflectance(view, oh, f), f));
    t.value = refraction_colour_ *
              (visible * distribution_.smith_g1(i) * (1 - f.reflectance) * (radiance_ ? 1 : sqr(view.eta)));
  }

  Microfacet distribution_;
  Gtr1 clearcoat_distribution_;
  float eta_, roughness_, flatness_;
  float clearcoat_, refraction_;  // scale of the value
  float specular_rate_, diffuse_weight_, clearcoat_weight_, refraction_weight_;
  float dielectric_;
  Spectrum diffuse_, sheen_, r0_, rise_, refraction_colour_;
  bool radiance_;
};

class Principled final : public Bsdf {
 public:
  Principled(PrincipledInputs inputs, const PrincipledSettings& settings)
      : in_(std::move(inputs)),
        settings_(settings),
        anisotropic_(!in_.anisotropic.is_constant() || in_.anisotropic.constant() > 0),
        refracts_(!in_.spec_trans.is_constant() || in_.spec_trans.constant() > 0),
        // If no parameter is textured, all points share the same closures.
        constant_(in_.base_color.is_constant() && numbers_are_constant()),
        constant_closures_{{constant_point(), settings, TransportMode::kRadiance},
                           {constant_point(), settings, TransportMode::kImportance}} {}

  uint32_t flags() const override {
    return kDiffuseReflection | kGlossyReflection | (refracts_ ? uint32_t{kGlossyTransmission} : 0u);
  }
  const BsdfClosure* bind(const SurfaceHit& hit, bool, TransportMode mode, Arena& arena) const override {
    if (constant_) return &constant_closures_[mode == TransportMode::kRadiance ? 0 : 1];
    return arena.make<PrincipledClosure>(point(hit), settings_, mode);
  }
  bool needs_derivatives() const override { return anisotropic_; }
  const Texture* main_texture() const override { return in_.base_color.texture(); }
  Spectrum albedo(const SurfaceHit& hit) const override { return clamp01(in_.base_color.eval(hit)); }

 private:
  bool numbers_are_constant() const {
    for (const NumberInput* n : {&in_.roughness, &in_.anisotropic, &in_.metallic, &in_.spec_trans, &in_.spec_tint,
                                 &in_.sheen, &in_.sheen_tint, &in_.flatness, &in_.clearcoat, &in_.clearcoat_gloss})
      if (!n->is_constant()) return false;
    return true;
  }
  PrincipledPoint point(const SurfaceHit& hit) const {
    const auto number = [&](const NumberInput& n) { return clamp01(n.eval(hit)); };
    return {in_.base_color.eval(hit), number(in_.roughness), number(in_.anisotropic),    number(in_.metallic),
            number(in_.spec_trans),   number(in_.spec_tint), number(in_.sheen),          number(in_.sheen_tint),
            number(in_.flatness),     number(in_.clearcoat), number(in_.clearcoat_gloss)};
  }

  PrincipledPoint constant_point() const { return constant_ ? point({}) : PrincipledPoint{}; }

  PrincipledInputs in_;
  PrincipledSettings settings_;
  bool anisotropic_, refracts_, constant_;
  PrincipledClosure constant_closures_[2];
};

float get_eta(Parameters& parameters, bool refracts) {
  if (parameters.has("eta")) {
    if (parameters.has("specular"))
      parameters.error_at("specular", "is given together with 'eta'; expected one of the two");
    const float eta = parameters.get_float("eta", 1.5f, 0.01f, 100.0f);
    return refracts && eta == 1 ? 1.001f : eta;
  }
  float specular = parameters.get_float("specular", 0.5f, 0.0f, 12.0f);
  if (refracts && specular == 0) specular = 1e-3f;
  return 2 / (1 - std::sqrt(0.08f * specular)) - 1;
}

}  // namespace

std::shared_ptr<Bsdf> make_principled(Parameters& parameters) {
  const auto fraction = [&](const char* name, float fallback = 0) { return get_fraction(parameters, name, fallback); };
  PrincipledInputs in{ColourInput(parameters, "base_color", 0.5f),
                      fraction("roughness", 0.5f),
                      fraction("anisotropic"),
                      fraction("metallic"),
                      fraction("spec_trans"),
                      fraction("spec_tint"),
                      fraction("sheen"),
                      fraction("sheen_tint"),
                      fraction("flatness"),
                      fraction("clearcoat"),
                      fraction("clearcoat_gloss")};
  const bool refracts = !in.spec_trans.is_constant() || in.spec_trans.constant() > 0;
  const auto rate = [&](const char* name) { return parameters.get_float(name, 1, 0, 1e6f); };
  const PrincipledSettings settings{get_eta(parameters, refracts), rate("diffuse_reflectance_sampling_rate"),
                                    rate("main_specular_sampling_rate"), rate("clearcoat_sampling_rate")};
  return std::make_shared<Principled>(std::move(in), settings);
}

}  // namespace covary
