// SPDX-License-Identifier: Apache-2.0
#include "bsdfs/perturbed.h"

namespace covary {
namespace {

class PerturbedClosure final : public BsdfClosure {
 public:
  PerturbedClosure(const BsdfClosure* nested, const Perturbation& p, TransportMode mode)
      : nested_(nested),
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
    BsdfValue v = eval_in(frame(flip), wo, wi);
    if (mode_ == TransportMode::kImportance && flips(wi) != flip)
      v.value = eval_in(frame(!flip), wo, wi).value;  // the camera's direction decides about the value
    return v;
  }
  BsdfSample sample(const Vec3& wo, float u_lobe, Vec2 u) const override {
    if (wo.z == 0) return {};
    const bool flip = flips(wo);
    const Frame& f = frame(flip);
    const Vec3 po = f.to_local(wo);
    BsdfSample s = nested_->sample(po, u_lobe, u);
    if (!s.valid()) return s;
    if (s.flags & kNullTransmission) {  // passes as if there were no surface
      s.wi = -wo;
      return s;
    }
    const Vec3 pi = s.wi;
    s.wi = f.to_world(pi);
    if (!(s.wi.z * pi.z > 0)) return {};
    if (mode_ == TransportMode::kImportance && flips(s.wi) != flip) {
      if (s.is_delta()) return {};
      s.weight = eval(wo, s.wi).value / s.pdf;
    } else {
      s.weight *= factor(wo, s.wi, po, pi);
    }
    return s;
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

 private:
  /// Whether the normal is turned about z for the camera's direction w.
  bool flips(const Vec3& w) const { return flip_invalid_ && w.z * dot(w, frame_.n) <= 0; }
  const Frame& frame(bool flip) const { return flip ? flipped_frame_ : frame_; }

  BsdfValue eval_in(const Frame& f, const Vec3& wo, const Vec3& wi) const {
    const Vec3 po = f.to_local(wo), pi = f.to_local(wi);
    BsdfValue v = nested_->eval(po, pi);
    v.value *= factor(wo, wi, po, pi);
    if (!(wi.z * pi.z > 0)) v.pdf_solid_angle = 0;  // sample() drops it
    return v;
  }
  /// Value over the nested model's value; `po`, `pi` are wo, wi in the perturbed frame.
  float factor(const Vec3& wo, const Vec3& wi, const Vec3& po, const Vec3& pi) const {
    if (mode_ == TransportMode::kRadiance) return wi.z * pi.z > 0 ? terminator(wi) : 0;
    // Adjoint: the light comes from wo, and its cosine in the perturbed frame replaces that of wi.
    if (!(wo.z * po.z > 0) || pi.z == 0) return 0;
    return terminator(wo) * std::abs(po.z * wi.z / (wo.z * pi.z));
  }
  /// [Estevez2019] GGX shadowing of the light's direction.
  float terminator(const Vec3& w) const { return alpha2_ > 0 ? 2 / (1 + std::sqrt(1 + alpha2_ * tan2_theta(w))) : 1; }

  const BsdfClosure* nested_;
  TransportMode mode_;
  bool flip_invalid_, shadow_terminator_;
  float alpha2_;
  Frame frame_, flipped_frame_;
};

}  // namespace

const BsdfClosure* make_perturbed(const BsdfClosure* nested, const Perturbation& perturbation, TransportMode mode,
                                  Arena& arena) {
  return arena.make<PerturbedClosure>(nested, perturbation, mode);
}

}  // namespace covary
