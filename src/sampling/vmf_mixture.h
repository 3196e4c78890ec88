// SPDX-License-Identifier: Apache-2.0
// Mixtures of von Mises-Fisher lobes for path guiding [Ruppert2020]. A VmfMixture stores the distance of each lobe's
// light, so that it can be moved to other points (parallax); VmfLobes is evaluated and sampled at one point, as
// structure of arrays.
#pragma once

#include "core/ray.h"
#include "sampling/vmf.h"

namespace covary {

/// Lobes with weights that sum to 1, or none.
struct VmfLobes {
  static constexpr int kMax = 32;
  int n = 0;  ///< followed by padding of weight 0 up to the next multiple of kLanes, then unused entries
  alignas(32) float weight[kMax] = {};
  alignas(32) float kappa[kMax] = {};
  alignas(32) float peak[kMax] = {};  ///< vmf::peak of kappa
  alignas(32) float x[kMax] = {}, y[kMax] = {}, z[kMax] = {};

  static constexpr int kLanes = 8;
  int padded() const { return (n + kLanes - 1) / kLanes * kLanes; }
  Vmf lobe(int k) const { return {{x[k], y[k], z[k]}, kappa[k]}; }
  void set(int k, float new_weight, const Vmf& lobe);
  /// Fills the padding after the n lobes.
  void pad();

  /// Density at the unit vector `w`, per unit solid angle; 0 without lobes.
  float pdf(const Vec3& w) const;
  /// Writes weight × density of each lobe to `parts`, which needs room for kMax; returns their sum, pdf(w).
  float pdfs(const Vec3& w, float* parts) const;
  /// The lobe chosen by `u` in [0, 1); there must be at least one.
  int choose(float u) const;
  /// Samples a direction with density pdf(); `u_lobe` in [0, 1) chooses the lobe.
  Vec3 sample(float u_lobe, Vec2 u) const { return vmf::sample(lobe(choose(u_lobe)), u); }
  /// Replaces the lobes by their normalised product with the cosine at the unit vector `normal`. The cosine is
  /// approximated by the vMF lobe of the same mean cosine 2/3, so that the product is again a mixture: the same lobes,
  /// reweighted and each turned towards the normal.
  void multiply_by_cosine(const Vec3& normal);
  VmfLobes times_cosine(const Vec3& normal) const {
    VmfLobes product = *this;
    product.multiply_by_cosine(normal);
    return product;
  }
};

struct VmfMixture {
  VmfLobes lobes;  ///< as seen from the pivot
  Vec3 pivot;
  /// 1 / distance from the pivot to the light of each lobe; 0: infinitely far.
  alignas(32) float inverse_distance[VmfLobes::kMax] = {};

  /// As seen from `p`: mean directions point from there to the lights.
  VmfLobes at(const Vec3& p) const;
  /// Same, written to another object up to the padding; entries beyond stay unchanged.
  void see_from(const Vec3& p, VmfLobes& written) const;
  /// The same lights with another pivot.
  VmfMixture moved_to(const Vec3& new_pivot) const;
};

}  // namespace covary
