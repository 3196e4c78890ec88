// SPDX-License-Identifier: Apache-2.0
// twosided: makes a one-sided reflection model reflect on both sides.
//
// | name               | type   | default | meaning                                                              |
// |--------------------|--------|---------|----------------------------------------------------------------------|
// | (nested)           | bsdf   |         | one model for both sides, or two: front (the normal's side), back    |
// | allow_transmission | bool   | false   | accept nested models that transmit light                             |
//
// The model on the back sees directions mirrored in the surface.
#include <optional>

#include "bsdfs/inputs.h"
#include "bsdfs/registry.h"
#include "scene/lambertian.h"

namespace covary {
namespace {

/// A closure seen from the other side.
class MirroredClosure final : public BsdfClosure {
 public:
  explicit MirroredClosure(const BsdfClosure* nested) : nested_(nested) {}

  uint32_t flags() const override { return nested_->flags(); }
  BsdfValue eval(const Vec3& wo, const Vec3& wi) const override { return nested_->eval(mirror(wo), mirror(wi)); }
  BsdfSample sample(const Vec3& wo, float u_lobe, Vec2 u) const override {
    BsdfSample s = nested_->sample(mirror(wo), u_lobe, u);
    s.wi.z = -s.wi.z;
    return s;
  }
  NullPassage null_passage(const Vec3& wo) const override { return nested_->null_passage(mirror(wo)); }
  int n_lobes() const override { return nested_->n_lobes(); }
  void lobe_pmfs(const Vec3& wo, float* pmfs) const override { nested_->lobe_pmfs(mirror(wo), pmfs); }
  void lobe_pdfs(const Vec3& wo, const Vec3& wi, float* pdfs) const override {
    nested_->lobe_pdfs(mirror(wo), mirror(wi), pdfs);
  }
  float reverse_pdf(const Vec3& wo, const Vec3& wi) const override {
    return nested_->reverse_pdf(mirror(wo), mirror(wi));
  }
  float reverse_pmf(const Vec3& wo, const BsdfSample& s) const override {
    BsdfSample nested = s;
    nested.wi = mirror(s.wi);
    return nested_->reverse_pmf(mirror(wo), nested);
  }

 private:
  static Vec3 mirror(const Vec3& w) { return {w.x, w.y, -w.z}; }
  const BsdfClosure* nested_;
};

/// Two models, at least one of which transmits light. The camera's side chooses the model: for radiance that of wo, for
/// importance that of wi, although directions are then sampled from the model on the side of wo. What the light's model
/// samples and the camera's cannot (refraction at two different interfaces) is found from the camera only.
class TransmittingClosure final : public BsdfClosure {
 public:
  /// `same`: one model on both sides, so that null transmission has the same probability from both.
  TransmittingClosure(const BsdfClosure* front, const BsdfClosure* back, bool same, TransportMode mode)
      : front_(front), back_(back), same_(same), importance_(mode == TransportMode::kImportance) {}

  uint32_t flags() const override { return front_->flags() | back_->flags(); }
  BsdfValue eval(const Vec3& wo, const Vec3& wi) const override {
    BsdfValue v = side(wo).eval(wo, wi);
    if (importance_ && crosses(wo, wi)) v.value = side(wi).eval(wo, wi).value;
    return v;
  }
  BsdfSample sample(const Vec3& wo, float u_lobe, Vec2 u) const override {
    BsdfSample s = side(wo).sample(wo, u_lobe, u);
    if (!importance_ || !s.valid() || !crosses(wo, s.wi)) return s;
    if (s.is_delta()) return passes(s) ? s : BsdfSample{};
    s.weight = side(s.wi).eval(wo, s.wi).value / s.pdf;
    return s;
  }
  /// For importance, only what is the same from both sides.
  NullPassage null_passage(const Vec3& wo) const override {
    return same_ || !importance_ ? side(wo).null_passage(wo) : NullPassage{};
  }
  int n_lobes() const override { return std::max(front_->n_lobes(), back_->n_lobes()); }
  void lobe_pmfs(const Vec3& wo, float* pmfs) const override {
    std::fill_n(pmfs, n_lobes(), 0.0f);
    side(wo).lobe_pmfs(wo, pmfs);
  }
  void lobe_pdfs(const Vec3& wo, const Vec3& wi, float* pdfs) const override {
    std::fill_n(pdfs, n_lobes(), 0.0f);
    side(wo).lobe_pdfs(wo, wi, pdfs);
  }
  float reverse_pdf(const Vec3& wo, const Vec3& wi) const override { return side(wi).reverse_pdf(wo, wi); }
  float reverse_pmf(const Vec3& wo, const BsdfSample& s) const override {
    return !crosses(wo, s.wi) || passes(s) ? side(s.wi).reverse_pmf(wo, s) : 0;
  }

 private:
  const BsdfClosure& side(const Vec3& w) const { return w.z > 0 ? *front_ : *back_; }
  static bool crosses(const Vec3& wo, const Vec3& wi) { return (wo.z > 0) != (wi.z > 0); }
  /// Whether the delta transmission `s` is found from both sides.
  bool passes(const BsdfSample& s) const { return same_ && (s.flags & kNullTransmission); }

  const BsdfClosure *front_, *back_;
  bool same_, importance_;
};

class TwoSided final : public Bsdf, public MaybeLambertian {
 public:
  TwoSided(BsdfPtr front, BsdfPtr back)
      : front_(std::move(front)), back_(std::move(back)), transmits_((flags() & kTransmission) != 0) {
    if (const Lambertian* nested = front_ == back_ ? lambertian_of(*front_) : nullptr)
      lambertian_ = {nested->reflectance, nested->texture, true};
  }

  uint32_t flags() const override { return front_->flags() | back_->flags(); }
  const BsdfClosure* bind(const SurfaceHit& hit, bool wo_front, TransportMode mode, Arena& arena) const override {
    if (transmits_) [[unlikely]]
      return bind_both(hit, mode, arena);
    if (wo_front) return front_->bind(hit, true, mode, arena);
    return arena.make<MirroredClosure>(back_->bind(hit, true, mode, arena));
  }
  bool depends_on_side() const override { return !transmits_; }
  bool needs_derivatives() const override { return front_->needs_derivatives() || back_->needs_derivatives(); }
  const Texture* main_texture() const override { return front_->main_texture(); }
  const Lambertian* lambertian() const override { return lambertian_ ? &*lambertian_ : nullptr; }
  Spectrum albedo(const SurfaceHit& hit) const override { return front_->albedo(hit); }

 private:
  /// Kept out of bind(), which is short and called for every hit.
  [[gnu::noinline]] const BsdfClosure* bind_both(const SurfaceHit& hit, TransportMode mode, Arena& arena) const {
    const BsdfClosure* front = front_->bind(hit, true, mode, arena);
    const BsdfClosure* back = arena.make<MirroredClosure>(back_->bind(hit, true, mode, arena));
    return arena.make<TransmittingClosure>(front, back, front_ == back_, mode);
  }

  BsdfPtr front_, back_;
  bool transmits_;
  std::optional<Lambertian> lambertian_;
};

}  // namespace

std::shared_ptr<Bsdf> make_twosided(Parameters& parameters) {
  const bool allow_transmission = parameters.get_bool("allow_transmission", false);
  const std::vector<BsdfPtr> nested = get_nested_bsdfs(parameters, 1, 2);
  if (nested.empty()) return nullptr;
  auto result = std::make_shared<TwoSided>(nested.front(), nested.back());
  if (!allow_transmission && (result->flags() & kTransmission)) {
    parameters.error(
        "a nested model transmits light; expected one that only reflects, or any with 'allow_transmission'");
    return nullptr;
  }
  return result;
}

}  // namespace covary
