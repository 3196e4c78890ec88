// SPDX-License-Identifier: Apache-2.0
// blendbsdf: a weighted mean of two models.
//
// | name     | type           | default  | meaning                                                           |
// |----------|----------------|----------|-------------------------------------------------------------------|
// | weight   | number/texture | required | fraction of the second model; clamped to [0, 1]                   |
// | (nested) | bsdf           |          | exactly two, in the order of the file                             |
//
// f = (1 - weight) f_first + weight f_second, sampled with the same probabilities. Lobes: those of the first model,
// then those of the second.
#include "bsdfs/inputs.h"
#include "bsdfs/registry.h"

namespace covary {
namespace {

class BlendClosure final : public BsdfClosure {
 public:
  BlendClosure(const BsdfClosure* first, const BsdfClosure* second, float weight)
      : nested_{first, second}, share_{1 - weight, weight} {}

  uint32_t flags() const override { return nested_[0]->flags() | nested_[1]->flags(); }
  BsdfValue eval(const Vec3& wo, const Vec3& wi) const override {
    const BsdfValue a = nested_[0]->eval(wo, wi), b = nested_[1]->eval(wo, wi);
    return {a.value * share_[0] + b.value * share_[1], a.pdf_solid_angle * share_[0] + b.pdf_solid_angle * share_[1]};
  }
  BsdfSample sample(const Vec3& wo, float u_lobe, Vec2 u) const override {
    const int i = u_lobe < share_[1] ? 1 : 0;
    const float remapped = i == 1 ? u_lobe / share_[1] : (u_lobe - share_[1]) / share_[0];
    BsdfSample s = nested_[i]->sample(wo, std::min(remapped, kOneMinusEpsilon), u);
    if (!s.valid()) return s;
    if (i == 1) s.lobe += static_cast<uint32_t>(nested_[0]->n_lobes());
    if (s.is_delta()) {
      s.pdf *= share_[i];
      return s;
    }
    const BsdfValue other = nested_[1 - i]->eval(wo, s.wi);
    const Spectrum value = s.weight * (s.pdf * share_[i]) + other.value * share_[1 - i];
    s.pdf = s.pdf * share_[i] + other.pdf_solid_angle * share_[1 - i];
    s.weight = value / s.pdf;
    return s;
  }
  NullPassage null_passage(const Vec3& wo) const override {
    const NullPassage a = nested_[0]->null_passage(wo), b = nested_[1]->null_passage(wo);
    return {a.transmittance * share_[0] + b.transmittance * share_[1], a.pmf * share_[0] + b.pmf * share_[1]};
  }
  int n_lobes() const override { return nested_[0]->n_lobes() + nested_[1]->n_lobes(); }
  void lobe_pmfs(const Vec3& wo, float* pmfs) const override {
    for (int i = 0; i < 2; pmfs += nested_[i++]->n_lobes()) {
      nested_[i]->lobe_pmfs(wo, pmfs);
      for (int l = 0; l < nested_[i]->n_lobes(); ++l) pmfs[l] *= share_[i];
    }
  }
  void lobe_pdfs(const Vec3& wo, const Vec3& wi, float* pdfs) const override {
    nested_[0]->lobe_pdfs(wo, wi, pdfs);
    nested_[1]->lobe_pdfs(wo, wi, pdfs + nested_[0]->n_lobes());
  }
  float reverse_pdf(const Vec3& wo, const Vec3& wi) const override {
    return share_[0] * nested_[0]->reverse_pdf(wo, wi) + share_[1] * nested_[1]->reverse_pdf(wo, wi);
  }
  float reverse_pmf(const Vec3& wo, const BsdfSample& s) const override {
    const auto n_first = static_cast<uint32_t>(nested_[0]->n_lobes());
    const int i = s.lobe < n_first ? 0 : 1;
    BsdfSample own = s;
    if (i == 1) own.lobe -= n_first;
    return share_[i] * nested_[i]->reverse_pmf(wo, own);
  }

 private:
  const BsdfClosure* nested_[2];
  float share_[2];
};

class Blend final : public Bsdf {
 public:
  Blend(NumberInput weight, BsdfPtr first, BsdfPtr second)
      : weight_(std::move(weight)), first_(std::move(first)), second_(std::move(second)) {}

  uint32_t flags() const override { return first_->flags() | second_->flags(); }
  const BsdfClosure* bind(const SurfaceHit& hit, bool wo_front, TransportMode mode, Arena& arena) const override {
    const BsdfClosure* first = first_->bind(hit, wo_front, mode, arena);
    const BsdfClosure* second = second_->bind(hit, wo_front, mode, arena);
    if (first->n_lobes() + second->n_lobes() > kMaxLobes) [[unlikely]]
      throw Error(ErrorCode::kInput, "'blendbsdf': the nested models have too many lobes; at most 8 together");
    return arena.make<BlendClosure>(first, second, clamp01(weight_.eval(hit)));
  }
  bool depends_on_side() const override { return first_->depends_on_side() || second_->depends_on_side(); }
  bool needs_derivatives() const override { return first_->needs_derivatives() || second_->needs_derivatives(); }
  Spectrum albedo(const SurfaceHit& hit) const override {
    return lerp(clamp01(weight_.eval(hit)), first_->albedo(hit), second_->albedo(hit));
  }

 private:
  NumberInput weight_;
  BsdfPtr first_, second_;
};

}  // namespace

std::shared_ptr<Bsdf> make_blendbsdf(Parameters& parameters) {
  const TexturePtr weight = parameters.find_texture("weight");
  if (!weight && !parameters.has("weight")) parameters.error("the number or texture 'weight' is missing");
  const std::vector<BsdfPtr> nested = get_nested_bsdfs(parameters, 2, 2);
  if (nested.empty() || !weight) return nullptr;
  return std::make_shared<Blend>(NumberInput(weight), nested[0], nested[1]);
}

}  // namespace covary
