// SPDX-License-Identifier: Apache-2.0
// metallicroughness: the material of glTF 2.0, by the formulas of its specification, appendix B.3, and of the
// extensions KHR_materials_specular, _ior, _transmission, _volume and _clearcoat.
//
// | name                | type           | default | meaning                                                         |
// |---------------------|----------------|---------|-----------------------------------------------------------------|
// | base_color          | colour/texture | 1       | colour of diffuse light, of metal, of transmitted light         |
// | metallic            | number/texture | 1       | blends dielectric and metal                                     |
// | roughness           | number/texture | 1       | GGX alpha is its square, at least 0.001                         |
// | ior                 | number         | 1.5     | index of refraction of the dielectric; 0: reflects everything   |
// | specular            | number/texture | 1       | strength of the dielectric's reflection                         |
// | specular_color      | colour/texture | 1       | its colour at normal incidence; may exceed 1                    |
// | transmission        | number/texture | 0       | blends diffuse reflection and transmission                      |
// | thin                | boolean        | true    | what transmits is a sheet without refraction, not a solid       |
// | clearcoat           | number/texture | 0       | strength of a second, clear layer of index 1.5                  |
// | clearcoat_roughness | number/texture | 0       | its roughness                                                   |
//
// With S(alpha) the GGX reflection with separable masking (as of edition 2.0.1), F the Schlick reflectance at the
// microfacet, T the transmission through microfacets and m = metallic, t = transmission, c = clearcoat:
//
//   dielectric = (1 - max F) ((1 - t) q base / pi + t base T) + F S, F from f0 = min(r0 specular_color, 1) specular
//   metal      = F' S,                                               F' from f0 = base
//   material   = (1 - k) ((1 - m) dielectric + m metal) + k S(coat),   k = c (0.04 + 0.96 (1 - |V.n|)^5)
//
// The specification demands that energy is conserved, but its sample implementation (q = 1) reflects up to 1.3 times
// the light for bright colours at grazing angles. Where the albedos E of diffuse and specular light add up to more than
// 1, q = (1 - E_s(V)) / (max base E_d(V)) leaves them 1.
//
// V is the direction of the viewer: neither q nor a coat is reciprocal. If nothing is transmitted, the side opposite
// the normal is black; a sheet looks alike from both sides; a solid refracts on both.
//
// Lobes: 0 diffuse (cosine-weighted), 1 reflection, 2 coat, 3 transmission (visible GGX normals).
#include "bsdfs/principled_terms.h"
#include "bsdfs/registry.h"
#include "bsdfs/schlick_albedo.h"
#include "core/warp.h"

namespace covary {
namespace {

constexpr float kCoatR0 = 0.04f;  // index 1.5

struct MetalRoughInputs {
  ColourInput base_color, specular_color;
  NumberInput metallic, roughness, specular, transmission, clearcoat, clearcoat_roughness;
};
struct MetalRoughPoint {
  Spectrum base, specular_color;
  float metallic, roughness, specular, transmission, clearcoat, clearcoat_roughness;
};
struct MetalRoughSettings {
  float ior;
  bool thin, transmits;
};

Microfacet ggx(float roughness) { return principled_distribution(roughness, 0); }

class MetalRoughClosure final : public BsdfClosure {
 public:
  MetalRoughClosure(const MetalRoughPoint& p, const MetalRoughSettings& settings, TransportMode mode)
      : distribution_(ggx(p.roughness)),
        coat_distribution_(ggx(p.clearcoat_roughness)),
        // A solid whose index is 1 would let light pass as a delta lobe.
        eta_(std::max(settings.ior, 1.001f)),
        roughness_(p.roughness),
        coat_(p.clearcoat),
        f90_(p.specular),
        metallic_(p.metallic),
        transmits_(settings.transmits),
        solid_(transmits_ && !settings.thin),
        radiance_(mode == TransportMode::kRadiance),
        base_(p.base) {
    const Spectrum r0 = p.specular_color * schlick_r0(settings.ior);
    f0_ = Spectrum(std::min(r0.r, 1.0f), std::min(r0.g, 1.0f), std::min(r0.b, 1.0f)) * p.specular;
    diffuse_ = p.base * ((1 - p.metallic) * (1 - p.transmission) * kInvPi);
    transmitted_ = p.base * ((1 - p.metallic) * p.transmission);
  }

  uint32_t flags() const override {
    return kDiffuseReflection | kGlossyReflection | (transmits_ ? uint32_t{kGlossyTransmission} : 0u);
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
    uint32_t lobe = 0;
    for (; lobe + 1 < kLobes && u_lobe >= view.pmf[lobe]; ++lobe) u_lobe -= view.pmf[lobe];
    const Vec3 i = direction(view, lobe, u);
    if (!(lobe == kTransmission ? i.z < 0 : i.z > 0)) return {};
    const Terms t = terms(view, i);
    const float pdf = t.mixture(view);
    if (!(t.pdf[lobe] > 0 && pdf > 0)) return {};
    return {.wi = view.front ? i : -i,
            .weight = t.value / pdf,
            .pdf = pdf,
            .eta = i.z < 0 && solid_ ? view.eta : 1,
            .flags = lobe == kDiffuse        ? uint32_t{kDiffuseReflection}
                     : lobe == kTransmission ? uint32_t{kGlossyTransmission}
                                             : uint32_t{kGlossyReflection},
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
  enum Lobe : uint32_t { kDiffuse, kReflection, kCoat, kTransmission, kLobes };

  /// Terms that depend on wo alone. From the back, directions are negated; in a solid, `inside` is true.
  struct View {
    View(const MetalRoughClosure& closure, const Vec3& wo) : front(wo.z > 0), o(front ? wo : -wo) {
      active = o.z > 0 && (front || closure.transmits_);
      inside = !front && closure.solid_;
      eta = inside ? 1 / closure.eta_ : closure.eta_;
      if (active) closure.lobe_probabilities(*this);
    }
    bool front, active, inside;
    Vec3 o;
    float eta;  // on the other side over that on the side of wo
    float pmf[kLobes] = {0, 0, 0, 0};
  };
  struct Terms {
    Spectrum value;
    float pdf[kLobes] = {0, 0, 0, 0};
    float mixture(const View& view) const {
      float sum = 0;
      for (uint32_t l = 0; l < kLobes; ++l) sum += view.pmf[l] * pdf[l];
      return sum;
    }
  };

  /// Estimates of the lobes' albedos, which must not depend on the transport mode. Diffuse light meets microfacets half
  /// way between o and the normal. What reflects at no angle seen here may do so at others: nothing is 0.
  void lobe_probabilities(View& view) const {
    const float z = view.o.z, half = std::sqrt(0.5f * (1 + z));
    const float coat = view.inside ? 0 : coat_ * std::max(coat_fresnel(z), 0.1f), base = 1 - coat;
    view.pmf[kDiffuse] = view.inside ? 0 : base * (1 - max_component(dielectric_fresnel(half))) * mean(diffuse_) * kPi;
    view.pmf[kReflection] = base * (mean(fresnel(lerp(0.5f * distribution_.alpha_u(), cosine(view, z), 1))) + 0.02f);
    view.pmf[kCoat] = coat;
    view.pmf[kTransmission] =
        base * std::max(1 - max_component(dielectric_fresnel(cosine(view, z))), 0.05f) * mean(transmitted_);
    float sum = 0;
    for (const float pmf : view.pmf) sum += pmf;
    for (float& pmf : view.pmf) pmf /= sum;
  }

  Vec3 direction(const View& view, uint32_t lobe, Vec2 u) const {
    if (lobe == kDiffuse) return warp::square_to_cosine_hemisphere(u);
    const Vec3 m = (lobe == kCoat ? coat_distribution_ : distribution_).sample(view.o, u).m;
    if (lobe == kTransmission && solid_) {
      const DielectricFresnel f = fresnel_dielectric(dot(view.o, m), view.eta);
      return f.reflectance < 1 ? normalize(refract(view.o, m, f.cos_theta_t, f.eta_ti)) : Vec3{};
    }
    const Vec3 i = reflect(view.o, m);
    return lobe == kTransmission ? Vec3{i.x, i.y, -i.z} : i;
  }

  /// Cosine at a microfacet on its optically thinner side, 0 for total reflection; `c` on the side of wo.
  float cosine(const View& view, float c) const { return view.inside ? safe_sqrt(1 - (1 - c * c) / sqr(view.eta)) : c; }
  static float coat_fresnel(float c) { return kCoatR0 + (1 - kCoatR0) * schlick_weight(c); }
  Spectrum dielectric_fresnel(float c) const { return lerp(schlick_weight(c), f0_, Spectrum(f90_)); }
  /// Of the mixture of dielectric and metal.
  Spectrum fresnel(float c) const {
    return lerp(metallic_, dielectric_fresnel(c), lerp(schlick_weight(c), base_, Spectrum(1)));
  }

  /// q for a viewer under the cosine `mu`.
  float diffuse_limit(float mu) const {
    const float f0 = max_component(f0_), left = 1 - schlick_specular_albedo(mu, roughness_).reflected(f0, f90_);
    const float diffuse = max_component(base_) * (1 - schlick_diffuse_albedo(mu).reflected(f0, f90_));
    return left < diffuse ? left / diffuse : 1;
  }

  /// Value and densities of the lobes; both directions as seen from the side of wo.
  Terms terms(const View& view, const Vec3& i) const {
    Terms t;
    const float k = coat_ > 0 ? coat_ * coat_fresnel(radiance_ ? view.o.z : std::abs(i.z)) : 0;
    if (i.z > 0)
      reflection_terms(view, i, k, t);
    else if (i.z < 0 && transmits_)
      solid_ ? refraction_terms(view, i, t) : sheet_terms(view, i, t);
    if (i.z < 0) t.value = t.value * (1 - k);
    return t;
  }
  void reflection_terms(const View& view, const Vec3& i, float k, Terms& t) const {
    const Vec3 h = normalize(view.o + i);
    const float c = cosine(view, dot(view.o, h));
    t.value = fresnel(c) * specular(distribution_, view.o, i, h, t.pdf[kReflection]);
    if (!view.inside) {
      if (max_component(diffuse_) > 0)
        t.value +=
            diffuse_ * ((1 - max_component(dielectric_fresnel(c))) * diffuse_limit(radiance_ ? view.o.z : i.z) * i.z);
      t.pdf[kDiffuse] = warp::cosine_hemisphere_pdf_solid_angle(i.z);
    }
    t.value = t.value * (1 - k);
    if (coat_ > 0 && !view.inside) t.value += Spectrum(k * specular(coat_distribution_, view.o, i, h, t.pdf[kCoat]));
  }
  /// Reflected light that goes straight through instead.
  void sheet_terms(const View& view, const Vec3& i, Terms& t) const {
    const Vec3 mirrored{i.x, i.y, -i.z}, h = normalize(view.o + mirrored);
    const float s = specular(distribution_, view.o, mirrored, h, t.pdf[kTransmission]);
    t.value = transmitted_ * ((1 - max_component(dielectric_fresnel(dot(view.o, h)))) * s);
  }
  void refraction_terms(const View& view, const Vec3& i, Terms& t) const {
    Vec3 h = view.o + i * view.eta;
    const float l2 = length_squared(h);  // (o.m + eta i.m)^2 of the paper
    h *= (h.z > 0 ? 1 : -1) / std::sqrt(l2);
    const float oh = dot(view.o, h), ih = dot(i, h);
    if (!(oh > 0 && ih < 0)) return;
    // [Walter2007] Eqs. (17) and (21); radiance is compressed by eta^2.
    const float visible = distribution_.eval(h) * distribution_.smith_g1_over_cos(view.o) * oh * -ih / l2;
    t.pdf[kTransmission] = visible * sqr(view.eta);
    const float passed = 1 - max_component(dielectric_fresnel(view.inside ? -ih : oh));
    t.value = transmitted_ * (passed * visible * distribution_.smith_g1(i) * (radiance_ ? 1 : sqr(view.eta)));
  }
  /// S times the cosine of i, and the density of reflection at visible normals.
  static float specular(const Microfacet& d, const Vec3& o, const Vec3& i, const Vec3& h, float& pdf) {
    pdf = 0.25f * d.eval(h) * d.smith_g1_over_cos(o);
    return pdf * d.smith_g1(i);
  }

  Microfacet distribution_, coat_distribution_;
  float eta_, roughness_, coat_, f90_, metallic_;
  bool transmits_, solid_, radiance_;
  Spectrum base_, f0_, diffuse_, transmitted_;
};

class MetalRough final : public Bsdf {
 public:
  MetalRough(MetalRoughInputs inputs, const MetalRoughSettings& settings)
      : in_(std::move(inputs)),
        settings_(settings),
        // If no parameter is textured, all points share the same closures.
        constant_(is_constant()),
        constant_closures_{{constant_point(), settings, TransportMode::kRadiance},
                           {constant_point(), settings, TransportMode::kImportance}} {}

  uint32_t flags() const override {
    return kDiffuseReflection | kGlossyReflection | (settings_.transmits ? uint32_t{kGlossyTransmission} : 0u);
  }
  const BsdfClosure* bind(const SurfaceHit& hit, bool, TransportMode mode, Arena& arena) const override {
    if (constant_) return &constant_closures_[mode == TransportMode::kRadiance ? 0 : 1];
    return arena.make<MetalRoughClosure>(point(hit), settings_, mode);
  }
  const Texture* main_texture() const override { return in_.base_color.texture(); }
  Spectrum albedo(const SurfaceHit& hit) const override { return clamp01(in_.base_color.eval(hit)); }

 private:
  bool is_constant() const {
    for (const NumberInput* n :
         {&in_.metallic, &in_.roughness, &in_.specular, &in_.transmission, &in_.clearcoat, &in_.clearcoat_roughness})
      if (!n->is_constant()) return false;
    return in_.base_color.is_constant() && in_.specular_color.is_constant();
  }
  MetalRoughPoint point(const SurfaceHit& hit) const {
    const auto number = [&](const NumberInput& n) { return clamp01(n.eval(hit)); };
    return {clamp01(in_.base_color.eval(hit)),
            in_.specular_color.eval(hit),
            number(in_.metallic),
            number(in_.roughness),
            number(in_.specular),
            number(in_.transmission),
            number(in_.clearcoat),
            number(in_.clearcoat_roughness)};
  }
  MetalRoughPoint constant_point() const { return constant_ ? point({}) : MetalRoughPoint{}; }

  MetalRoughInputs in_;
  MetalRoughSettings settings_;
  bool constant_;
  MetalRoughClosure constant_closures_[2];
};

}  // namespace

std::shared_ptr<Bsdf> make_metallicroughness(Parameters& parameters) {
  const auto fraction = [&](const char* name, float fallback) { return get_fraction(parameters, name, fallback); };
  MetalRoughInputs in{ColourInput(parameters, "base_color", 1),
                      ColourInput(parameters.get_texture("specular_color", Spectrum(1), SpectrumRole::kEmission)),
                      fraction("metallic", 1),
                      fraction("roughness", 1),
                      fraction("specular", 1),
                      fraction("transmission", 0),
                      fraction("clearcoat", 0),
                      fraction("clearcoat_roughness", 0)};
  const bool transmits = !in.transmission.is_constant() || in.transmission.constant() > 0;
  const MetalRoughSettings settings{parameters.get_float("ior", 1.5f, 0, 100), parameters.get_bool("thin", true),
                                    transmits};
  return std::make_shared<MetalRough>(std::move(in), settings);
}

}  // namespace covary
