// SPDX-License-Identifier: Apache-2.0
// metallicroughness: the material of glTF 2.0, by the formulas of its specification, appendix B.3, and of the
// extensions KHR_materials_specular, _ior, _transmission, _diffuse_transmission, _volume, _clearcoat, _sheen,
// _anisotropy and _iridescence.
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
// | clearcoat_normal    | texture        |         | the layer's own normal, as in `normalmap`; otherwise the base's |
// | base_normal         | texture        |         | with that: the map of the `normalmap` around this, if any       |
// | sheen_color         | colour/texture | 0       | of light reflected by fibres on top (charlie_sheen.h)           |
// | sheen_roughness     | number/texture | 0       | its roughness                                                   |
// | anisotropy          | number         | 0       | blends GGX alpha along the direction of anisotropy with 1       |
// | anisotropy_rotation | number         | 0       | its direction in radians, counter-clockwise from dp/du          |
// | anisotropy_map      | texture        |         | red, green: (d + 1) / 2 of a direction; blue: factor            |
// | iridescence         | number/texture | 0       | blends Schlick's reflectance with a thin film's (iridescence.h) |
// | iridescence_ior     | number         | 1.3     | index of the film                                               |
// | iridescence_thickness | number/texture | 400   | its thickness in nanometres                                     |
// | diffuse_transmission | number/texture | 0      | blends diffuse reflection and diffuse transmission              |
// | diffuse_transmission_color | colour/texture | 1 | of the latter                                                  |
//
// With S(alpha) the GGX reflection with separable masking (as of edition 2.0.1), F the Schlick reflectance at the
// microfacet, T the transmission through microfacets and m = metallic, t = transmission, c = clearcoat:
//
//   dielectric = (1 - max F) ((1 - t) q base / pi + t base T) + F S, F from f0 = min(r0 specular_color, 1) specular
//   metal      = F' S,                                               F' from f0 = base
//   cloth      = sheen + s ((1 - m) dielectric + m metal),            s = 1 - max sheen_color max(E(V.n), E(L.n))
//   material   = (1 - k) cloth + k S(coat),                           k = c (0.04 + 0.96 (1 - |V.n|)^5)
//
// with E the albedo of white sheen. Of the light that would be reflected diffusely, diffuse_transmission goes to the
// other side instead.
//
// The specification demands that energy is conserved, but its sample implementation (q = 1) reflects up to 1.3 times
// the light for bright colours at grazing angles. Where the albedos E of diffuse and specular light add up to more than
// 1, q = (1 - E_s(V)) / (max base E_d(V)) leaves them 1.
//
// A coat with a normal of its own has its cosines and microfacets about that normal.
//
// V is the direction of the viewer: neither q nor a coat is reciprocal. If nothing is transmitted, the side opposite
// the normal is black; a sheet looks alike from both sides; a solid refracts on both.
//
// Lobes: 0 diffuse and sheen (cosine-weighted), 1 reflection, 2 coat, 3 transmission (visible GGX normals), 4 diffuse
// transmission (cosine-weighted).
#include "bsdfs/metallicroughness.h"

#include "bsdfs/charlie_sheen.h"
#include "bsdfs/iridescence.h"
#include "bsdfs/principled_terms.h"
#include "bsdfs/registry.h"
#include "bsdfs/schlick_albedo.h"
#include "core/warp.h"

namespace covary {
namespace {

constexpr float kCoatR0 = 0.04f;  // index 1.5

/// KHR_materials_anisotropy: alpha along x is blended with 1.
Microfacet ggx(float roughness, float anisotropy = 0) {
  const float alpha = std::max(sqr(roughness), 0.001f);
  return {MicrofacetType::kGgx, lerp(sqr(anisotropy), alpha, 1.0f), alpha};
}

class MetalRoughClosure final : public BsdfClosure {
 public:
  MetalRoughClosure(const MetalRoughPoint& p, const MetalRoughSettings& settings, TransportMode mode)
      : distribution_(ggx(p.roughness, p.anisotropy)),
        coat_distribution_(ggx(p.clearcoat_roughness)),
        // A solid whose index is 1 would let light pass as a delta lobe.
        eta_(std::max(settings.ior, 1.001f)),
        roughness_(p.roughness),
        coat_(p.clearcoat),
        f90_(p.specular),
        metallic_(p.metallic),
        film_(p.iridescence),
        film_ior_(settings.iridescence_ior),
        film_thickness_(p.thickness),
        cos_turn_(p.cos_turn),
        sin_turn_(p.sin_turn),
        flags_(settings.flags()),
        solid_(settings.transmits && !settings.thin),
        radiance_(mode == TransportMode::kRadiance),
        base_(p.base),
        sheen_(p.sheen),
        sheen_model_(p.sheen_roughness),
        sheen_roughness_(p.sheen_roughness) {
    tilted_ = !(p.coat_normal == Vec3{0, 0, 1});
    if (tilted_) coat_frame_ = Frame::from_tangent(turned(p.coat_normal, sin_turn_), {1, 0, 0});
    const Spectrum r0 = p.specular_color * schlick_r0(settings.ior);
    f0_ = Spectrum(std::min(r0.r, 1.0f), std::min(r0.g, 1.0f), std::min(r0.b, 1.0f)) * p.specular;
    const float scattered = (1 - p.metallic) * (1 - p.transmission) * kInvPi;
    diffuse_ = p.base * (scattered * (1 - p.through));
    through_ = p.through_color * (scattered * p.through);
    transmitted_ = p.base * ((1 - p.metallic) * p.transmission);
  }

  uint32_t flags() const override { return flags_; }
  BsdfValue eval(const Vec3& wo, const Vec3& wi) const override {
    const View view(*this, wo);
    if (!view.active) return {};
    const Terms t = terms(view, local(view, wi));
    return {t.value, t.mixture(view)};
  }
  BsdfSample sample(const Vec3& wo, float u_lobe, Vec2 u) const override {
    const View view(*this, wo);
    if (!view.active) return {};
    uint32_t lobe = 0;
    for (; lobe + 1 < kLobes && u_lobe >= view.pmf[lobe]; ++lobe) u_lobe -= view.pmf[lobe];
    const Vec3 i = direction(view, lobe, u);
    if (!(lobe >= kTransmission ? i.z < 0 : i.z > 0)) return {};
    const Terms t = terms(view, i);
    const float pdf = t.mixture(view);
    if (!(t.pdf[lobe] > 0 && pdf > 0)) return {};
    static constexpr uint32_t kFlags[kLobes] = {kDiffuseReflection, kGlossyReflection, kGlossyReflection,
                                                kGlossyTransmission, kDiffuseTransmission};
    const Vec3 wi = turned(i, -sin_turn_);
    return {.wi = view.front ? wi : -wi,
            .weight = t.value / pdf,
            .pdf = pdf,
            .eta = i.z < 0 && solid_ ? view.eta : 1,
            .flags = kFlags[lobe],
            .lobe = lobe};
  }
  int n_lobes() const override { return kLobes; }
  void lobe_pmfs(const Vec3& wo, float* pmfs) const override { std::copy_n(View(*this, wo).pmf, kLobes, pmfs); }
  void lobe_pdfs(const Vec3& wo, const Vec3& wi, float* pdfs) const override {
    const View view(*this, wo);
    const Terms t = view.active ? terms(view, local(view, wi)) : Terms{};
    std::copy_n(t.pdf, kLobes, pdfs);
  }

 private:
  enum Lobe : uint32_t { kDiffuse, kReflection, kCoat, kTransmission, kThrough, kLobes };

  /// Terms that depend on wo alone. From the back, directions are negated; in a solid, `inside` is true.
  struct View {
    View(const MetalRoughClosure& closure, const Vec3& wo) : front(wo.z > 0) {
      o = closure.turned(front ? wo : -wo, closure.sin_turn_);
      active = o.z > 0 && (front || closure.transmits());
      inside = !front && closure.solid_;
      eta = inside ? 1 / closure.eta_ : closure.eta_;
      if (active) closure.lobe_probabilities(*this);
    }
    bool front, active, inside;
    Vec3 o;
    float eta;  // on the other side over that on the side of wo
    float pmf[kLobes] = {};
  };
  struct Terms {
    Spectrum value;
    float pdf[kLobes] = {};
    float mixture(const View& view) const {
      float sum = 0;
      for (uint32_t l = 0; l < kLobes; ++l) sum += view.pmf[l] * pdf[l];
      return sum;
    }
  };

  bool transmits() const { return (flags_ & (kGlossyTransmission | kDiffuseTransmission)) != 0; }
  /// In the frame whose x axis is the direction of anisotropy; back with the opposite sine.
  Vec3 turned(const Vec3& w, float sine) const {
    return {cos_turn_ * w.x + sine * w.y, cos_turn_ * w.y - sine * w.x, w.z};
  }
  /// In the frame of the coat's normal.
  Vec3 in_coat(const Vec3& w) const { return tilted_ ? coat_frame_.to_local(w) : w; }
  Vec3 local(const View& view, const Vec3& wi) const { return turned(view.front ? wi : -wi, sin_turn_); }

  /// Estimates of the lobes' albedos, which must not depend on the transport mode. Diffuse light meets microfacets half
  /// way between o and the normal. What reflects at no angle seen here may do so at others: nothing is 0.
  void lobe_probabilities(View& view) const {
    const float z = view.o.z, half = std::sqrt(0.5f * (1 + z));
    const float coat_z = in_coat(view.o).z;
    const float coat = view.inside || coat_z <= 0 ? 0 : coat_ * std::max(coat_fresnel(coat_z), 0.1f), base = 1 - coat;
    const float passed = view.inside ? 0 : base * std::max(1 - max_component(dielectric_fresnel(half)), 0.05f);
    view.pmf[kDiffuse] =
        passed * mean(diffuse_) * kPi + (has_sheen() ? base * mean(sheen_) * charlie_albedo(z, sheen_roughness_) : 0);
    view.pmf[kThrough] = passed * mean(through_) * kPi;
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
    if (lobe == kThrough) return -warp::square_to_cosine_hemisphere(u);
    if (lobe == kCoat && tilted_) {
      const Vec3 o = in_coat(view.o), i = reflect(o, coat_distribution_.sample(o, u).m);
      return i.z > 0 ? coat_frame_.to_world(i) : Vec3{};
    }
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
  Spectrum dielectric_fresnel(float c) const {
    return under_film(lerp(schlick_weight(c), f0_, Spectrum(f90_)), f0_, c);
  }
  /// Of the mixture of dielectric and metal.
  Spectrum fresnel(float c) const {
    const Spectrum metal = under_film(lerp(schlick_weight(c), base_, Spectrum(1)), base_, c);
    return lerp(metallic_, dielectric_fresnel(c), metal);
  }
  Spectrum under_film(const Spectrum& bare, const Spectrum& f0, float c) const {
    if (!(film_ > 0)) return bare;
    const Spectrum film = thin_film_reflectance(f0, film_ior_, film_thickness_, clamp01(c));
    return lerp(film_, bare, {std::min(film.r, 1.0f), std::min(film.g, 1.0f), std::min(film.b, 1.0f)});
  }
  bool has_sheen() const { return max_component(sheen_) > 0; }
  /// s: what sheen leaves for light between these cosines.
  float under_sheen(float o, float i) const {
    if (!has_sheen()) return 1;
    const float albedo = std::max(charlie_albedo(o, sheen_roughness_), charlie_albedo(i, sheen_roughness_));
    return std::max(1 - max_component(sheen_) * albedo, 0.0f);
  }

  /// q for a viewer under the cosine `mu`.
  float diffuse_limit(float mu) const {
    const float f0 = max_component(f0_);
    const float left = std::max(1 - schlick_specular_albedo(mu, roughness_).reflected(f0, f90_), 0.0f);
    const float diffuse = max_component(base_) * (1 - schlick_diffuse_albedo(mu).reflected(f0, f90_));
    return left < diffuse ? left / diffuse : 1;
  }

  /// Value and densities of the lobes; both directions as seen from the side of wo.
  Terms terms(const View& view, const Vec3& i) const {
    Terms t;
    const float viewed = radiance_ ? in_coat(view.o).z : std::abs(in_coat(i).z);
    const float k = coat_ > 0 && viewed > 0 ? coat_ * coat_fresnel(viewed) : 0;
    if (i.z > 0)
      reflection_terms(view, i, k, t);
    else if (i.z < 0 && transmits()) {
      solid_ ? refraction_terms(view, i, t) : sheet_terms(view, i, t);
      through_terms(view, i, t);
    }
    if (i.z < 0) t.value = t.value * ((1 - k) * under_sheen(view.o.z, -i.z));
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
    if (has_sheen()) t.value = t.value * under_sheen(view.o.z, i.z) + sheen_ * sheen_model_.eval(view.o, i, h);
    t.value = t.value * (1 - k);
    if (coat_ > 0 && !view.inside) t.value += Spectrum(k * coat_term(view.o, i, h, t.pdf[kCoat]));
  }
  float coat_term(const Vec3& o, const Vec3& i, const Vec3& h, float& pdf) const {
    if (!tilted_) return specular(coat_distribution_, o, i, h, pdf);
    const Vec3 oc = in_coat(o), ic = in_coat(i);
    if (!(oc.z > 0 && ic.z > 0)) return 0;
    const float value = specular(coat_distribution_, oc, ic, in_coat(h), pdf);
    return radiance_ ? value : value * oc.z * i.z / (o.z * ic.z);  // the adjoint has the cosine of the other direction
  }
  /// Reflected light that goes straight through instead.
  void sheet_terms(const View& view, const Vec3& i, Terms& t) const {
    const Vec3 mirrored{i.x, i.y, -i.z}, h = normalize(view.o + mirrored);
    const float s = specular(distribution_, view.o, mirrored, h, t.pdf[kTransmission]);
    t.value = transmitted_ * ((1 - max_component(dielectric_fresnel(dot(view.o, h)))) * s);
  }
  void through_terms(const View& view, const Vec3& i, Terms& t) const {
    if (view.inside) return;
    const Vec3 h = normalize(view.o + Vec3{i.x, i.y, -i.z});
    t.value += through_ * ((1 - max_component(dielectric_fresnel(dot(view.o, h)))) * -i.z);
    t.pdf[kThrough] = warp::cosine_hemisphere_pdf_solid_angle(-i.z);
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
  float eta_, roughness_, coat_, f90_, metallic_, film_, film_ior_, film_thickness_, cos_turn_, sin_turn_;
  uint32_t flags_;
  bool solid_, radiance_, tilted_;
  Frame coat_frame_;
  Spectrum base_, f0_, diffuse_, transmitted_, through_, sheen_;
  CharlieSheen sheen_model_;
  float sheen_roughness_;
};

class MetalRough final : public Bsdf {
 public:
  MetalRough(MetalRoughInputs inputs, const MetalRoughSettings& settings)
      : in_(std::move(inputs)),
        settings_(settings),
        // If no parameter is textured, all points share the same closures.
        constant_(is_constant(in_) && (settings.anisotropy == 0 || settings.anisotropy_rotation == 0)),
        constant_closures_{{constant_point(), settings, TransportMode::kRadiance},
                           {constant_point(), settings, TransportMode::kImportance}} {}

  uint32_t flags() const override { return settings_.flags(); }
  bool needs_derivatives() const override { return settings_.anisotropy != 0 || in_.clearcoat_normal; }
  const BsdfClosure* bind(const SurfaceHit& hit, bool, TransportMode mode, Arena& arena) const override {
    if (constant_) return &constant_closures_[mode == TransportMode::kRadiance ? 0 : 1];
    return arena.make<MetalRoughClosure>(point_of(in_, settings_, hit), settings_, mode);
  }
  const Texture* main_texture() const override { return in_.base_color.texture(); }
  Spectrum albedo(const SurfaceHit& hit) const override { return clamp01(in_.base_color.eval(hit)); }

 private:
  MetalRoughPoint constant_point() const { return constant_ ? point_of(in_, settings_, {}) : MetalRoughPoint{}; }

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
                      ColourInput(parameters, "sheen_color", 0),
                      ColourInput(parameters, "diffuse_transmission_color", 1),
                      fraction("metallic", 1),
                      fraction("roughness", 1),
                      fraction("specular", 1),
                      fraction("transmission", 0),
                      fraction("clearcoat", 0),
                      fraction("clearcoat_roughness", 0),
                      fraction("sheen_roughness", 0),
                      fraction("iridescence", 0),
                      NumberInput(parameters.get_texture("iridescence_thickness", 400)),
                      fraction("diffuse_transmission", 0),
                      parameters.find_texture("anisotropy_map"),
                      parameters.find_texture("clearcoat_normal"),
                      parameters.find_texture("base_normal")};
  const auto some = [](const NumberInput& n) { return !n.is_constant() || n.constant() > 0; };
  const MetalRoughSettings settings{parameters.get_float("ior", 1.5f, 0, 100),
                                    parameters.get_float("iridescence_ior", 1.3f, 1, 100),
                                    parameters.get_float("anisotropy", 0, 0, 1),
                                    parameters.get_float("anisotropy_rotation", 0),
                                    parameters.get_bool("thin", true),
                                    some(in.transmission),
                                    some(in.through)};
  return std::make_shared<MetalRough>(std::move(in), settings);
}

}  // namespace covary
