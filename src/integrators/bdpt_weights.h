// SPDX-License-Identifier: Apache-2.0
// Weights of multiple importance sampling for bidirectional path tracing, in constant time for each technique.
//
// A path x_0 … x_k, from the light to the lens, is found by techniques (s, t), s + t = k + 1: the light subpath holds
// x_0 … x_{s-1}, the camera subpath the other t vertices. With p_s the density of technique s, the heuristic of
// exponent b gives it the weight
//     w_s = 1 / sum_i (p_i / p_s)^b = 1 / (1 + sum_{i<s} (p_i / p_s)^b + sum_{i>s} (p_i / p_s)^b).
// Neighbours differ in the density of one vertex, so each of the two sums is a product of a sum along one subpath,
// which is known where the subpath was traced, and of densities at the connection: the quantities dVCM and dVC of
// [Georgiev2012] without vertex merging. They differ from the text in these points: densities of area are squared
// in double precision, because their squares leave the range of float for scenes of unusual size; the probability of a
// light is not the same for emission as for light samples; a technique that cannot produce the path adds nothing.
//
// Roulette and the visibility between vertices are left out of all densities alike.
#pragma once

#include <algorithm>
#include <cmath>

#include "scene/bsdf.h"
#include "scene/emitter.h"

namespace covary {

enum class Heuristic { kPower, kBalance };

/// What the end of a subpath knows of the techniques in which the other subpath is longer.
struct SubpathSums {
  double vcm = 0;  ///< dVCM: of the technique whose other subpath ends here
  double vc = 0;   ///< dVC: of those whose other subpath is longer still
  bool any() const { return vcm > 0 || vc > 0; }
};

/// Density of what a vertex did, or could do in the opposite direction.
struct ScatterPdfs {
  double pdf = 0;      ///< of the direction in which the subpath goes on; for a delta lobe the probability of it
  double reverse = 0;  ///< of the direction it came from, for a path of the other end; 0: not possible
  bool is_delta = false;
};

/// Cosine between a unit normal and a unit direction, kept away from 0 so that sums stay finite.
inline double mis_cosine(const Vec3& n, const Vec3& w) {
  return std::max(std::abs(static_cast<double>(dot(n, w))), 1e-9);
}

/// The techniques s = 0, 1, 2 at a light differ in how its point x_0 is found.
struct LightPdfs {
  double direct = 0;    ///< of the light sample at x_1: probability of the light and density of x_0, see below
  double emission = 0;  ///< of emission: probability of the light, densities of position and direction
  double cosine = 1;    ///< at x_0; 1 for lights that are points or infinitely far away
  bool is_delta = false;
};

/// `direct` and `emission` of LightPdfs such that p_2 / p_1 = emission cos_1 / direct times the density of x_1 from the
/// camera's side: the light sample's density per unit solid angle, times the cosine at the light; times the squared
/// distance where the position is a delta.
inline LightPdfs light_pdfs(const Emitter& emitter, double nee_pmf, double pdf_solid_angle, double emission_pmf,
                            const EmissionPdf& emission, const Vec3& n, const Vec3& w, double distance_squared) {
  LightPdfs pdfs;
  pdfs.is_delta = emitter.is_delta();
  if (!emitter.is_infinite() && !emitter.is_delta_position()) pdfs.cosine = mis_cosine(n, w);
  pdfs.direct = nee_pmf * pdf_solid_angle * (emitter.is_delta_position() ? distance_squared : pdfs.cosine);
  pdfs.emission = emission_pmf * emission.position * emission.direction;
  return pdfs;
}

class BidirectionalMis {
 public:
  explicit BidirectionalMis(Heuristic heuristic) : power_(heuristic == Heuristic::kPower) {}

  /// A ratio of densities as the heuristic counts it.
  double raised(double ratio) const { return power_ ? ratio * ratio : ratio; }

  /// The sums behind a vertex that has `at`, in a direction with the cosine |cos| to its geometric normal.
  SubpathSums leave(const SubpathSums& at, double cosine, const ScatterPdfs& pdfs) const {
    const double vcm = pdfs.is_delta ? 0 : at.vcm;
    return {pdfs.is_delta ? 0 : raised(1 / pdfs.pdf), raised(cosine / pdfs.pdf) * (vcm + raised(pdfs.reverse) * at.vc)};
  }

  /// The sums of the surface that a subpath meets next: densities per solid angle become those per area.
  SubpathSums arrive(const SubpathSums& left, double cosine, double distance_squared) const {
    return {left.vcm * raised(distance_squared / cosine), left.vc * raised(1 / cosine)};
  }

  /// Sum of (p_i / p_s)^b over the techniques in which the other subpath takes vertices of this one, from its end on.
  /// `pdf_area`: density of the end, sampled from the other subpath; `reverse`: that of the direction from there to the
  /// vertex before, per unit solid angle.
  double others(const SubpathSums& end, double pdf_area, double reverse) const {
    return raised(pdf_area) * (end.vcm + raised(reverse) * end.vc);
  }

  /// The sums at x_1 of a light subpath, met with the cosine `cosine` to its normal.
  SubpathSums first_surface(const LightPdfs& light, double cosine) const {
    return {raised(light.direct / (light.emission * cosine)),
            light.is_delta ? 0 : raised(light.cosine / (light.emission * cosine))};
  }
  /// Sum over the other techniques where a camera subpath meets a light; `left`: behind its last but one vertex.
  double others_of_hit(const SubpathSums& left, const LightPdfs& light) const {
    return raised(light.direct / light.cosine) * left.vcm + raised(light.emission / light.cosine) * left.vc;
  }
  /// The same for a light sample at the end `end` of a camera subpath, with the cosine `cosine` to its normal. `pdf`:
  /// density of the direction to the light, sampled by the surface; `reverse` as for others().
  double others_of_light_sample(const SubpathSums& end, const LightPdfs& light, double cosine, double pdf,
                                double reverse) const {
    const double hit = light.is_delta ? 0 : raised(pdf * light.cosine / light.direct);
    return hit + others(end, light.emission * cosine / light.direct, reverse);
  }

 private:
  bool power_;
};

/// Densities of a direction sample; `wo` as it was given to sample(). For refraction by a delta lobe the reverse
/// probability is scaled by d(omega_i) / d(omega_o) = cos_o / (eta^2 cos_i), the ratio of the solid angles that both
/// directions fill, so that weights are the limit of those of rough surfaces.
inline ScatterPdfs scatter_pdfs(const BsdfClosure& bsdf, const Vec3& wo, const BsdfSample& sample) {
  if (!sample.is_delta()) return {sample.pdf, bsdf.reverse_pdf(wo, sample.wi), false};
  double reverse = bsdf.reverse_pmf(wo, sample);
  if (sample.eta != 1) reverse *= std::abs(wo.z / (sample.wi.z * sample.eta * sample.eta));
  return {sample.pdf, reverse, true};
}

}  // namespace covary
