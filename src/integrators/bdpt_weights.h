// SPDX-License-Identifier: Apache-2.0
// Multiple importance sampling weights for bidirectional path tracing, in constant time per technique.
//
// A path x_0 … x_k, from the light to the lens, is found by techniques (s, t), s + t = k + 1: the light subpath
// consists of x_0 … x_{s-1}, the camera subpath of the other t vertices. With p_s the density of technique s, the
// power heuristic, b = 2, gives it the weight
//     w_s = 1 / sum_i (p_i / p_s)^b = 1 / (1 + sum_{i<s} (p_i / p_s)^b + sum_{i>s} (p_i / p_s)^b).
// Neighbouring techniques differ in the density of one vertex, so each of the two sums is the product of a sum along
// one subpath, accumulated while it is traced, and densities at the connection: the quantities dVCM and dVC of
// [Georgiev2012] without vertex merging. Differences from the text: area densities are squared in double precision,
// because their squares exceed the range of float for scenes of unusual size; the probability of a light differs
// between emission and light samples; a technique that cannot produce the path adds nothing.
//
// Roulette and the visibility between vertices are left out of all densities.
// Roulette and the visibility between vertices are left out of all densities alike.
#pragma once

#include <algorithm>
#include <cmath>

#include "scene/bsdf.h"
#include "scene/emitter.h"

namespace covary {

/// What the end of a subpath contributes for the techniques in which the other subpath is longer.
struct SubpathSums {
  double vcm = 0;  ///< dVCM: for the technique whose other subpath ends here
  double vc = 0;   ///< dVC: for those whose other subpath is longer still
  bool any() const { return vcm > 0 || vc > 0; }
};

/// Densities of a vertex's direction sample, and of the opposite direction.
struct ScatterPdfs {
  double pdf = 0;      ///< of the direction in which the subpath continues; for a delta lobe its probability
  double reverse = 0;  ///< of the direction it came from, for a subpath from the other end; 0: impossible
  bool is_delta = false;
};

/// Cosine between a unit normal and a unit direction, bounded away from 0 so that sums stay finite.
inline double mis_cosine(const Vec3& n, const Vec3& w) {
  return std::max(std::abs(static_cast<double>(dot(n, w))), 1e-9);
}

/// The techniques s = 0, 1, 2 at a light differ in how its point x_0 is found.
struct LightPdfs {
  double direct = 0;    ///< of the light sample from x_1: probability of the light times density of x_0, see below
  double emission = 0;  ///< of emission: probability of the light times densities of position and direction
  double cosine = 1;    ///< at x_0; 1 for point-like or infinitely distant lights
  bool is_delta = false;
};

/// `direct` and `emission` of LightPdfs such that p_2 / p_1 = emission cos_1 / direct times the density of x_1 sampled
/// from the camera's side: the light sample's density per unit solid angle, times the cosine at the light; for delta
/// positions, times the squared distance.
inline LightPdfs light_pdfs(const Emitter& emitter, double nee_pmf, double pdf_solid_angle, double emission_pmf,
                            const EmissionPdf& emission, const Vec3& n, const Vec3& w, double distance_squared) {
  LightPdfs pdfs;
  pdfs.is_delta = emitter.is_delta();
  const bool is_point = emitter.is_delta_position() && !emitter.shape();
  if (!emitter.is_infinite() && !is_point) pdfs.cosine = mis_cosine(n, w);
  pdfs.direct = nee_pmf * pdf_solid_angle * (is_point ? distance_squared : pdfs.cosine);
  pdfs.emission = emission_pmf * emission.position * emission.direction;
  return pdfs;
}

class BidirectionalMis {
 public:
  /// A ratio of densities raised to the heuristic's exponent.
  static double raised(double ratio) { return ratio * ratio; }

  /// The sums after leaving a vertex with sums `at` in a direction with cosine |cos| to its geometric normal.
  SubpathSums leave(const SubpathSums& at, double cosine, const ScatterPdfs& pdfs) const {
    const double vcm = pdfs.is_delta ? 0 : at.vcm;
    return {pdfs.is_delta ? 0 : raised(1 / pdfs.pdf), raised(cosine / pdfs.pdf) * (vcm + raised(pdfs.reverse) * at.vc)};
  }

  /// The sums on arrival at the next surface: densities per solid angle become densities per area.
  SubpathSums arrive(const SubpathSums& left, double cosine, double distance_squared) const {
    return {left.vcm * raised(distance_squared / cosine), left.vc * raised(1 / cosine)};
  }

  /// Sum of (p_i / p_s)^b over the techniques in which the other subpath takes over vertices of this one, from its end
  /// on. `pdf_area`: density of the end, sampled from the other subpath; `reverse`: that of the direction from there to
  /// the previous vertex, per unit solid angle.
  double others(const SubpathSums& end, double pdf_area, double reverse) const {
    return raised(pdf_area) * (end.vcm + raised(reverse) * end.vc);
  }

  /// The sums at x_1 of a light subpath that arrives with cosine `cosine` to its normal.
  SubpathSums first_surface(const LightPdfs& light, double cosine) const {
    return {raised(light.direct / (light.emission * cosine)),
            light.is_delta ? 0 : raised(light.cosine / (light.emission * cosine))};
  }
  /// Sum over the other techniques when a camera subpath hits a light; `left`: sums after leaving its penultimate
  /// vertex.
  double others_of_hit(const SubpathSums& left, const LightPdfs& light) const {
    return raised(light.direct / light.cosine) * left.vcm + raised(light.emission / light.cosine) * left.vc;
  }
  /// Same for a light sample from the end `end` of a camera subpath, with cosine `cosine` to its normal. `pdf`: density
  /// of the direction to the light when sampled by the surface; `reverse` as for others().
  double others_of_light_sample(const SubpathSums& end, const LightPdfs& light, double cosine, double pdf,
                                double reverse) const {
    const double hit = light.is_delta ? 0 : raised(pdf * light.cosine / light.direct);
    return hit + others(end, light.emission * cosine / light.direct, reverse);
  }
};

/// Densities of a direction sample; `wo` as passed to sample(). For refraction by a delta lobe, the reverse probability
/// is scaled by d(omega_i) / d(omega_o) = cos_o / (eta^2 cos_i), the ratio of the solid angles around the two
/// directions, so that weights are the limit of those of rough surfaces.
inline ScatterPdfs scatter_pdfs(const BsdfClosure& bsdf, const Vec3& wo, const BsdfSample& sample) {
  if (!sample.is_delta()) return {sample.pdf, bsdf.reverse_pdf(wo, sample.wi), false};
  double reverse = bsdf.reverse_pmf(wo, sample);
  if (sample.eta != 1) reverse *= std::abs(wo.z / (sample.wi.z * sample.eta * sample.eta));
  return {sample.pdf, reverse, true};
}

}  // namespace covary
