// SPDX-License-Identifier: Apache-2.0
#include "bsdfs/perturbed.h"

namespace covary {
namespace {

class PerturbedClosure final : public BsdfClosure {
 public:
  PerturbedClosure(const PerturbedModel& model, const Perturbation& p, TransportMode mode)
      : nested_(model.here),
        beyond_(model.beyond),
        front_(model.wo_front),
        mode_(mode),
        flip_invalid_(p.flip_invalid),
        shadow_terminator_(p.shadow_terminator),
        frame_(Frame::from_tangent(p.normal, p.tangent)) {
    const Vec3& n = p.normal;
    if (flip_invalid_) flipped_frame_ = Frame::from_tangent({-n.x, -n.y, n.z}, p.tangent);
    // [Estevez2019] roughness of the equivalent microsurface.
    alpha2_ = shadow_terminator_ ? std::min(0.125f * tan2_theta(n), 1.0f) : 0;
  }

  uint32_t flags() const override { return nested_->flags(); }
  BsdfValue eval(const Vec3& wo, const Vec3& wi) const override {
    if (wo.z == 0 || wi.z == 0) return {};
    const bool flip = flips(wo);
    BsdfValue v = eval_in(frame(flip), *nested_, wo, wi);
    if (mode_ == TransportMode::kImportance && differs_for(wi, flip))  // the camera's direction determines the value
      v.value = eval_in(frame(flips(wi)), nested(wi), wo, wi).value;
    return v;
  }
  BsdfSample sample(const Vec3& wo, float u_lobe, Vec2 u) const override {
    if (wo.z == 0) return {};
    const bool flip = flips(wo);
    const Frame& f = frame(flip);
    const Vec3 po = f.to_local(wo);
    BsdfSample s = nested_->sample(po, u_lobe, u);
    if (!s.valid()) return s;
    if (s.flags & kNullTransmission) {  // passes unaffected by the perturbation
      s.wi = -wo;
      return s;
    }
    const Vec3 pi = s.wi;
    s.wi = f.to_world(pi);
    if (!(s.wi.z * pi.z > 0)) return {};
    if (mode_ == TransportMode::kImportance && differs_for(s.wi, flip)) {
      if (s.is_delta()) return {};
      s.weight = eval(wo, s.wi).value / s.pdf;
    } else {
      s.weight *= factor(wo, s.wi, po, pi);
    }
    return s;
  }
  NullPassage null_passage(const Vec3& wo) const override {
    return wo.z == 0 ? NullPassage{} : nested_->null_passage(frame(flips(wo)).to_local(wo));
  }
  int n_lobes() const override { return nested_->n_lobes(); }
  void lobe_pmfs(const Vec3& wo, float* pmfs) const override {
    nested_->lobe_pmfs(frame(flips(wo)).to_local(wo), pmfs);
  }
  void lobe_pdfs(const Vec3& wo, const Vec3& wi, float* pdfs) const override {
    const Frame& f = frame(flips(wo));
    const Vec3 pi = f.to_local(wi);
    nested_->lobe_pdfs(f.to_local(wo), pi, pdfs);
    if (!(wi.z * pi.z > 0))
      for (int i = 0; i < nested_->n_lobes(); ++i) pdfs[i] = 0;
  }
  float reverse_pdf(const Vec3& wo, const Vec3& wi) const override {
    const Frame& f = frame(flips(wi));
    const Vec3 po = f.to_local(wo);
    return wo.z * po.z > 0 ? nested(wi).reverse_pdf(po, f.to_local(wi)) : 0;
  }
  float reverse_pmf(const Vec3& wo, const BsdfSample& s) const override {
    const bool flip = flips(s.wi);
    const Frame& f = frame(flip);
    BsdfSample in_frame = s;
    in_frame.wi = f.to_local(s.wi);
    const Vec3 po = f.to_local(wo);
    if (s.flags & kNullTransmission) return nested(s.wi).reverse_pmf(po, in_frame);
    // A reversed delta pair needs the same frame and model, and must leave on the side it appears to.
    return flip == flips(wo) && &nested(wo) == &nested(s.wi) && wo.z * po.z > 0 ? nested_->reverse_pmf(po, in_frame)
                                                                                : 0;
  }

 private:
  /// Whether the normal is flipped (rotated by 180 degrees about z) for the camera direction w.
  bool flips(const Vec3& w) const { return flip_invalid_ && w.z * dot(w, frame_.n) <= 0; }
  const Frame& frame(bool flip) const { return flip ? flipped_frame_ : frame_; }
  /// The nested model for a path arriving from w.
  const BsdfClosure& nested(const Vec3& w) const { return (w.z > 0) == front_ ? *nested_ : *beyond_; }
  /// Whether a path arriving from w uses another frame than `flip` says, or another model than nested_.
  bool differs_for(const Vec3& w, bool flip) const { return flips(w) != flip || &nested(w) != nested_; }

  BsdfValue eval_in(const Frame& f, const BsdfClosure& nested, const Vec3& wo, const Vec3& wi) const {
    const Vec3 po = f.to_local(wo), pi = f.to_local(wi);
    BsdfValue v = nested.eval(po, pi);
    v.value *= factor(wo, wi, po, pi);
    if (!(wi.z * pi.z > 0)) v.pdf_solid_angle = 0;  // sample() drops it
    return v;
  }
  /// Ratio of the value to the nested model's; `po`, `pi` are wo, wi in the perturbed frame.
  float factor(const Vec3& wo, const Vec3& wi, const Vec3& po, const Vec3& pi) const {
    if (mode_ == TransportMode::kRadiance) return wi.z * pi.z > 0 ? terminator(wi) : 0;
    // Adjoint: light arrives from wo, so its cosine in the perturbed frame takes the place of wi's.
    if (!(wo.z * po.z > 0) || pi.z == 0) return 0;
    return terminator(wo) * std::abs(po.z * wi.z / (wo.z * pi.z));
  }
  /// [Estevez2019] GGX shadowing for the light's direction.
  float terminator(const Vec3& w) const { return alpha2_ > 0 ? 2 / (1 + std::sqrt(1 + alpha2_ * tan2_theta(w))) : 1; }

  const BsdfClosure *nested_, *beyond_;
  bool front_;
  TransportMode mode_;
  bool flip_invalid_, shadow_terminator_;
  float alpha2_;
  Frame frame_, flipped_frame_;
};

}  // namespace

const BsdfClosure* make_perturbed(const PerturbedModel& model, const Perturbation& perturbation, TransportMode mode,
                                  Arena& arena) {
  return arena.make<PerturbedClosure>(model, perturbation, mode);
}

}  // namespace covary
