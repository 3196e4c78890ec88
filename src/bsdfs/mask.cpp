// SPDX-License-Identifier: Apache-2.0
// mask: a model with opacity; the rest of the light passes straight through.
//
// | name     | type           | default | meaning                                                             |
// |----------|----------------|---------|---------------------------------------------------------------------|
// | opacity  | number/texture | 0.5     | fraction that meets the nested model; the rest passes; clamped to [0, 1] |
// | (nested) | bsdf           |         | exactly one                                                         |
//
// f = opacity f_nested + (1 - opacity) delta(wi = -wo). Lobes: those of the nested model, then the null lobe.
#include "bsdfs/inputs.h"
#include "bsdfs/registry.h"

namespace covary {
namespace {

class MaskClosure final : public BsdfClosure {
 public:
  MaskClosure(const BsdfClosure* nested, float opacity) : nested_(nested), opacity_(opacity) {}

  uint32_t flags() const override { return nested_->flags() | kNullTransmission; }
  BsdfValue eval(const Vec3& wo, const Vec3& wi) const override {
    const BsdfValue v = nested_->eval(wo, wi);
    return {v.value * opacity_, v.pdf_solid_angle * opacity_};
  }
  BsdfSample sample(const Vec3& wo, float u_lobe, Vec2 u) const override {
    if (u_lobe < opacity_) {
      BsdfSample s = nested_->sample(wo, std::min(u_lobe / opacity_, kOneMinusEpsilon), u);
      s.pdf *= opacity_;
      return s;
    }
    return {.wi = -wo,
            .weight = Spectrum(1),
            .pdf = 1 - opacity_,
            .eta = 1,
            .flags = kNullTransmission,
            .lobe = static_cast<uint32_t>(nested_->n_lobes())};
  }
  NullPassage null_passage(const Vec3& wo) const override {
    const NullPassage nested = nested_->null_passage(wo);
    return {Spectrum(1 - opacity_) + nested.transmittance * opacity_, 1 - opacity_ + nested.pmf * opacity_};
  }
  int n_lobes() const override { return nested_->n_lobes() + 1; }
  void lobe_pmfs(const Vec3& wo, float* pmfs) const override {
    const int n = nested_->n_lobes();
    nested_->lobe_pmfs(wo, pmfs);
    for (int i = 0; i < n; ++i) pmfs[i] *= opacity_;
    pmfs[n] = 1 - opacity_;
  }
  void lobe_pdfs(const Vec3& wo, const Vec3& wi, float* pdfs) const override {
    nested_->lobe_pdfs(wo, wi, pdfs);
    pdfs[nested_->n_lobes()] = 0;
  }
  float reverse_pdf(const Vec3& wo, const Vec3& wi) const override { return opacity_ * nested_->reverse_pdf(wo, wi); }
  float reverse_pmf(const Vec3& wo, const BsdfSample& s) const override {
    const bool passes = s.lobe == static_cast<uint32_t>(nested_->n_lobes());
    return passes ? 1 - opacity_ : opacity_ * nested_->reverse_pmf(wo, s);
  }

 private:
  const BsdfClosure* nested_;
  float opacity_;
};

class Mask final : public Bsdf {
 public:
  Mask(NumberInput opacity, BsdfPtr nested) : opacity_(std::move(opacity)), nested_(std::move(nested)) {}

  uint32_t flags() const override { return nested_->flags() | kNullTransmission; }
  const BsdfClosure* bind(const SurfaceHit& hit, bool wo_front, TransportMode mode, Arena& arena) const override {
    const float opacity = clamp01(opacity_.eval(hit));
    const BsdfClosure* nested = nested_->bind(hit, wo_front, mode, arena);
    if (opacity == 1) return nested;
    if (nested->n_lobes() >= kMaxLobes) [[unlikely]]
      throw Error(ErrorCode::kInput, "'mask': the nested models have too many lobes; at most 8 with the mask's own");
    return arena.make<MaskClosure>(nested, opacity);
  }
  bool depends_on_side() const override { return nested_->depends_on_side(); }
  bool needs_derivatives() const override { return nested_->needs_derivatives(); }
  Spectrum albedo(const SurfaceHit& hit) const override { return nested_->albedo(hit); }

 private:
  NumberInput opacity_;
  BsdfPtr nested_;
};

}  // namespace

std::shared_ptr<Bsdf> make_mask(Parameters& parameters) {
  NumberInput opacity(parameters.get_texture("opacity", 0.5f));
  const std::vector<BsdfPtr> nested = get_nested_bsdfs(parameters, 1, 1);
  if (nested.empty()) return nullptr;
  return std::make_shared<Mask>(std::move(opacity), nested[0]);
}

}  // namespace covary
