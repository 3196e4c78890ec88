// SPDX-License-Identifier: Apache-2.0
// A model with a perturbed shading normal, for bump and normal maps.
#pragma once

#include "bsdfs/inputs.h"

namespace covary {

struct Perturbation {
  Vec3 normal;             ///< unit, in the local shading frame, usually z > 0
  Vec3 tangent;            ///< direction of the perturbed frame's s axis, in the local shading frame
  bool flip_invalid;       ///< flip the normal about z if it faces away from the camera's side
  bool shadow_terminator;  ///< soften the transition to shadow at grazing light
};

/// The nested model, bound for the side of wo, and also for the other side if that differs and can be reached: without
/// flip_invalid a path may see the tilted surface from behind.
struct PerturbedModel {
  const BsdfClosure* here;
  const BsdfClosure* beyond;
  bool wo_front;

  static PerturbedModel bind(const Bsdf& nested, bool flip_invalid, const SurfaceHit& hit, bool wo_front,
                             TransportMode mode, Arena& arena) {
    const BsdfClosure* here = nested.bind(hit, wo_front, mode, arena);
    const bool both = !flip_invalid && nested.depends_on_side();
    return {here, both ? nested.bind(hit, !wo_front, mode, arena) : here, wo_front};
  }
};

/// `model` with the perturbed normal. Allocated in the arena like every closure.
///
/// flip_invalid after Schüßler et al. 2017, "Microfacet-based Normal Mapping for Robust Monte Carlo Path Tracing";
/// shadow_terminator after Estevez et al. 2019, "A Microfacet-Based Shadowing Function to Solve the Bump Terminator
/// Problem". Light that would leave through the unperturbed surface is dropped, so energy may be lost but never gained
/// through the back.
///
/// The value is not symmetric in light and camera. For importance it is the exact adjoint of the value for radiance,
/// f*(wo, wi) = f(wi, wo), so that light and camera paths estimate the same image. Some pairs of directions whose two
/// sides choose different flips are found from the camera only: mirror reflections among them carry no importance, and
/// the densities of the light's side (reverse_pdf, reverse_pmf) are 0.
const BsdfClosure* make_perturbed(const PerturbedModel& model, const Perturbation& perturbation, TransportMode mode,
                                  Arena& arena);

/// Wraps a model and perturbs its normal according to its parameters.
class PerturbingBsdf : public Bsdf {
 public:
  uint32_t flags() const final { return nested_->flags(); }
  bool depends_on_side() const final { return nested_->depends_on_side(); }
  bool needs_derivatives() const final { return true; }
  Spectrum albedo(const SurfaceHit& hit) const final { return nested_->albedo(hit); }

 protected:
  PerturbingBsdf(BsdfPtr nested, Parameters& p)
      : nested_(std::move(nested)),
        flip_invalid_(p.get_bool("flip_invalid_normals", true)),
        shadow_terminator_(p.get_bool("use_shadowing_function", true)) {}

  BsdfPtr nested_;
  bool flip_invalid_, shadow_terminator_;
};

}  // namespace covary
