// SPDX-License-Identifier: Apache-2.0
// coating, roughcoating: a smooth or rough dielectric layer on another model [WeidlichWilkie2007]. From Mitsuba 0.x.
//
// | name                 | type           | default  | meaning                                                      |
// |----------------------|----------------|----------|--------------------------------------------------------------|
// | (nested)             | bsdf           |          | the model below                                              |
// | int_ior              | number/string  | bk7      | index of refraction of the layer                             |
// | ext_ior              | number/string  | air      | index of refraction outside; must differ from int_ior        |
// | sigma_a              | colour/texture | 0        | absorption in the layer, per unit of `thickness`             |
// | thickness            | number         | 1        | of the layer                                                 |
// | specular_reflectance | colour/texture | 1        | factor on the layer's reflection                             |
// | distribution, alpha, sample_visible |  |          | `roughcoating`: as for roughplastic                          |
//
// The layer reflects like dielectric or roughdielectric. Its transmittance T is 1 - F, or that of a rough interface
// (rough_transmittance.h). With wo', wi' refracted at the shading normal, the nested model adds
//     f(wo', wi') T(wo) T(wi) / eta^2 exp(-sigma_a thickness (1 / cos_o' + 1 / cos_i'))
// Light that the layer reflects back down is lost, as in Mitsuba 0.x.
#include "bsdfs/coated.h"
#include "bsdfs/fresnel.h"
#include "bsdfs/registry.h"
#include "bsdfs/rough_transmittance.h"

namespace covary {
namespace {

/// The layer at one point.
struct Layer {
  float eta;
  Spectrum absorption;  ///< sigma_a times thickness
  Spectrum specular;
  float specular_weight;  ///< share of the layer's lobe if it reflected half of the light
  RoughSurface surface;
  const RoughTransmittance* rough;  ///< null: smooth

  float transmittance(float cosine) const {
    const float c = std::abs(cosine);
    return rough ? (*rough)(c) : 1 - fresnel_dielectric(c, eta).reflectance;
  }
  /// `w` inside the layer, on the same side.
  Vec3 inside(const Vec3& w) const {
    const Vec3 t{w.x / eta, w.y / eta, 0};
    return {t.x, t.y, std::copysign(safe_sqrt(1 - t.x * t.x - t.y * t.y), w.z)};
  }
  /// The inverse of inside(); z is 0 if the direction cannot leave.
  Vec3 outside(const Vec3& w) const {
    const Vec3 t{w.x * eta, w.y * eta, 0};
    return {t.x, t.y, std::copysign(safe_sqrt(1 - t.x * t.x - t.y * t.y), w.z)};
  }
  /// Solid angle inside over that outside.
  float jacobian(float cos_outside, float cos_inside) const { return std::abs(cos_outside / (cos_inside * eta * eta)); }
  /// What is left of light on its way down and up.
  Spectrum attenuation(const Vec3& wo, const Vec3& wi, const Vec3& wo_inside, const Vec3& wi_inside) const {
    const float length = 1 / std::abs(wo_inside.z) + 1 / std::abs(wi_inside.z);
    const float t = transmittance(wo.z) * transmittance(wi.z);
    return Spectrum(std::exp(-absorption.r * length), std::exp(-absorption.g * length),
                    std::exp(-absorption.b * length)) *
           t;
  }
  float pmf(const Vec3& wo) const {
    const float t = transmittance(wo.z), own = (1 - t) * specular_weight, below = t * (1 - specular_weight);
    return own + below > 0 ? own / (own + below) : 1;
  }
};

class CoatingClosure final : public BsdfClosure {
 public:
  CoatingClosure(const BsdfClosure* nested, const Layer& layer) : nested_(nested), layer_(layer) {}

  uint32_t flags() const override {
    return nested_->flags() | (layer_.rough ? uint32_t{kGlossyReflection} : uint32_t{kDeltaReflection});
  }
  BsdfValue eval(const Vec3& wo, const Vec3& wi) const override {
    if (wo.z == 0 || wi.z == 0) return {};
    const Vec3 o = layer_.inside(wo), i = layer_.inside(wi);
    if (o.z == 0 || i.z == 0) return {};
    const float jacobian = layer_.jacobian(wi.z, i.z), pmf = layer_.pmf(wo);
    BsdfValue v = nested_->eval(o, i);
    v.value *= layer_.attenuation(wo, wi, o, i) * jacobian;
    v.pdf_solid_angle *= (1 - pmf) * jacobian;
    if (layer_.rough && wo.z * wi.z > 0) add_rough(wo, wi, pmf, v);
    return v;
  }
  BsdfSample sample(const Vec3& wo, float u_lobe, Vec2 u) const override {
    if (wo.z == 0) return {};
    const float pmf = layer_.pmf(wo);
    if (u_lobe < pmf) return layer_.rough ? sample_rough(wo, u) : mirrored(wo, pmf);
    const Vec3 o = layer_.inside(wo);
    if (o.z == 0) return {};
    BsdfSample s = nested_->sample(o, std::min((u_lobe - pmf) / (1 - pmf), kOneMinusEpsilon), u);
    if (!s.valid()) return s;
    const Vec3 i = s.wi;
    s.wi = layer_.outside(i);
    ++s.lobe;
    if (s.wi.z == 0) return {};
    if (s.is_delta() || !layer_.rough) {
      s.weight *= layer_.attenuation(wo, s.wi, o, i) / (1 - pmf);
      s.pdf *= (1 - pmf) * (s.is_delta() ? 1 : layer_.jacobian(s.wi.z, i.z));
      return s;
    }
    return weighted(s, wo);
  }
  NullPassage null_passage(const Vec3& wo) const override {
    if (wo.z == 0) return {};
    const Vec3 o = layer_.inside(wo);
    NullPassage passage = nested_->null_passage(o);
    passage.transmittance *= layer_.attenuation(wo, -wo, o, -o);
    passage.pmf *= 1 - layer_.pmf(wo);
    return passage;
  }
  int n_lobes() const override { return 1 + nested_->n_lobes(); }
  void lobe_pmfs(const Vec3& wo, float* pmfs) const override {
    std::fill_n(pmfs, n_lobes(), 0.0f);
    if (wo.z == 0) return;
    nested_->lobe_pmfs(layer_.inside(wo), pmfs + 1);
    pmfs[0] = layer_.pmf(wo);
    for (int l = 1; l < n_lobes(); ++l) pmfs[l] *= 1 - pmfs[0];
  }
  void lobe_pdfs(const Vec3& wo, const Vec3& wi, float* pdfs) const override {
    std::fill_n(pdfs, n_lobes(), 0.0f);
    if (wo.z == 0 || wi.z == 0) return;
    const Vec3 i = layer_.inside(wi);
    nested_->lobe_pdfs(layer_.inside(wo), i, pdfs + 1);
    for (int l = 1; l < n_lobes(); ++l) pdfs[l] *= layer_.jacobian(wi.z, i.z);
    if (layer_.rough && wo.z * wi.z > 0) pdfs[0] = rough_pdf(wo, wi);
  }
  float reverse_pdf(const Vec3& wo, const Vec3& wi) const override {
    if (wo.z == 0 || wi.z == 0) return 0;
    const Vec3 o = layer_.inside(wo);
    const float pmf = layer_.pmf(wi);
    const float below = nested_->reverse_pdf(o, layer_.inside(wi)) * layer_.jacobian(wo.z, o.z);
    return (1 - pmf) * below + (layer_.rough && wo.z * wi.z > 0 ? pmf * rough_pdf(wi, wo) : 0);
  }
  float reverse_pmf(const Vec3& wo, const BsdfSample& s) const override {
    const float pmf = layer_.pmf(s.wi);
    if (s.lobe == 0) return pmf;
    BsdfSample below = s;
    below.wi = layer_.inside(s.wi);
    --below.lobe;
    return (1 - pmf) * nested_->reverse_pmf(layer_.inside(wo), below);
  }

 private:
  static Vec3 upward(const Vec3& w) { return w.z < 0 ? Vec3{w.x, w.y, -w.z} : w; }
  static float side(const Vec3& w) { return w.z < 0 ? -1 : 1; }

  float rough_pdf(const Vec3& wo, const Vec3& wi) const {
    const Vec3 o = upward(wo), m = normalize(o + upward(wi));
    return layer_.surface.pdf(o, m) / (4 * dot(o, m));
  }
  void add_rough(const Vec3& wo, const Vec3& wi, float pmf, BsdfValue& v) const {
    const Vec3 o = upward(wo), i = upward(wi), m = normalize(o + i);
    const Microfacet& normals = layer_.surface.normals;
    const float fresnel = fresnel_dielectric(dot(o, m), layer_.eta).reflectance;
    v.value += layer_.specular * (fresnel * normals.eval(m) * normals.smith_g(o, i, m) / (4 * o.z));
    v.pdf_solid_angle += pmf * rough_pdf(wo, wi);
  }
  BsdfSample mirrored(const Vec3& wo, float pmf) const {
    const float reflectance = fresnel_dielectric(std::abs(wo.z), layer_.eta).reflectance;
    return {.wi = reflect(wo),
            .weight = layer_.specular * (reflectance / pmf),
            .pdf = pmf,
            .eta = 1,
            .flags = kDeltaReflection};
  }
  BsdfSample sample_rough(const Vec3& wo, Vec2 u) const {
    const Vec3 o = upward(wo), i = reflect(o, layer_.surface.sample(o, u).m);
    if (!(i.z > 0)) return {};
    BsdfSample s;
    s.wi = {i.x, i.y, i.z * side(wo)};
    s.flags = kGlossyReflection;
    s.pdf = 1;
    return weighted(s, wo);
  }
  /// Weight and density of the mixture of smooth lobes for the direction of `s`.
  BsdfSample weighted(BsdfSample s, const Vec3& wo) const {
    const BsdfValue v = eval(wo, s.wi);
    if (!(v.pdf_solid_angle > 0)) return {};
    s.pdf = v.pdf_solid_angle;
    s.weight = v.value / s.pdf;
    return s;
  }

  const BsdfClosure* nested_;
  Layer layer_;
};

class Coating final : public Bsdf {
 public:
  Coating(Parameters& p, BsdfPtr nested, bool rough)
      : nested_(std::move(nested)),
        eta_(get_relative_ior(p, "bk7")),
        thickness_(p.get_float("thickness", 1, 0)),
        absorption_(p.get_texture("sigma_a", Spectrum(0), SpectrumRole::kIndex)),
        specular_(p, "specular_reflectance", 1) {
    if (eta_ == 1) p.error("'int_ior' and 'ext_ior' are equal; they must differ");
    specular_weight_ = 1 / (1 + std::exp(-2 * thickness_ * absorption_.mean()));
    if (!rough) return;
    const RoughnessInput roughness = get_roughness(p);
    if (roughness.anisotropic || !roughness.alpha_u.is_constant())
      p.error_at(roughness.anisotropic ? "alpha_u" : "alpha", "is not one number; expected one number 'alpha'");
    surface_ = roughness.eval({});
    if (eta_ != 1) rough_ = shared_transmittance(surface_.normals, eta_);
  }

  uint32_t flags() const override {
    return nested_->flags() | (rough_ ? uint32_t{kGlossyReflection} : uint32_t{kDeltaReflection});
  }
  const BsdfClosure* bind(const SurfaceHit& hit, bool wo_front, TransportMode mode, Arena& arena) const override {
    const BsdfClosure* nested = nested_->bind(hit, wo_front, mode, arena);
    if (nested->n_lobes() + 1 > kMaxLobes) [[unlikely]]
      throw Error(ErrorCode::kInput, "'coating': the nested model has too many lobes; at most 7");
    return arena.make<CoatingClosure>(nested, Layer{eta_, absorption_.eval(hit) * thickness_, specular_.eval(hit),
                                                    specular_weight_, surface_, rough_.get()});
  }
  bool depends_on_side() const override { return nested_->depends_on_side(); }
  bool needs_derivatives() const override { return nested_->needs_derivatives(); }
  const Texture* main_texture() const override { return nested_->main_texture(); }
  Spectrum albedo(const SurfaceHit& hit) const override { return nested_->albedo(hit); }

 private:
  BsdfPtr nested_;
  float eta_, thickness_, specular_weight_ = 0.5f;
  ColourInput absorption_, specular_;
  RoughSurface surface_{Microfacet(MicrofacetType::kBeckmann, 0.1f, 0.1f), true};
  std::shared_ptr<const RoughTransmittance> rough_;  // null: smooth
};

std::shared_ptr<Bsdf> make(Parameters& parameters, bool rough) {
  const std::vector<BsdfPtr> nested = get_nested_bsdfs(parameters, 1, 1);
  if (nested.empty()) return nullptr;
  return std::make_shared<Coating>(parameters, nested[0], rough);
}

}  // namespace

std::shared_ptr<Bsdf> make_coating(Parameters& parameters) { return make(parameters, false); }
std::shared_ptr<Bsdf> make_roughcoating(Parameters& parameters) { return make(parameters, true); }

}  // namespace covary
