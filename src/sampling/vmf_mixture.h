// SPDX-License-Identifier: Apache-2.0
// Mixtures of von Mises-Fisher lobes, as path guiding uses them [Ruppert2020]. A VmfMixture knows how far away each
// lobe's light is, so that it can be seen from elsewhere (parallax); VmfLobes is what is evaluated and sampled at one
// point, as arrays over lobes.
#pragma once

#include "core/ray.h"
#include "sampling/vmf.h"

namespace covary {

/// Lobes with weights that add up to 1, or none.
struct VmfLobes {
  static constexpr int kMax = 32;
  int n = 0;  ///< entries behind are padding of weight 0 up to the next multiple of kLanes, and unused ones
  alignas(32) float weight[kMax] = {};
  alignas(32) float kappa[kMax] = {};
  alignas(32) float peak[kMax] = {};  ///< vmf::peak of kappa
  alignas(32) float x[kMax] = {}, y[kMax] = {}, z[kMax] = {};

  static constexpr int kLanes = 8;
  int padded() const { return (n + kLanes - 1) / kLanes * kLanes; }
  Vmf lobe(int k) const { return {{x[k], y[k], z[k]}, kappa[k]}; }
  void set(int k, float new_weight, const Vmf& lobe);
  /// Fills the padding behind n lobes.
  void pad();

  /// Density at the unit vector `w`, per unit solid angle; 0 without lobes.
  float pdf(const Vec3& w) const;
  /// Writes weight × density of each lobe to `parts`, room for kMax; returns their sum, pdf(w).
  float pdfs(const Vec3& w, float* parts) const;
  /// The lobe that `u` in [0, 1) chooses; there must be one.
  int choose(float u) const;
  /// A direction of density pdf(); `u_lobe` in [0, 1) chooses the lobe.
  Vec3 sample(float u_lobe, Vec2 u) const { return vmf::sample(lobe(choose(u_lobe)), u); }
  /// The lobes become the normalised product with the cosine at the unit vector `normal`. The cosine is replaced by the
  /// vMF lobe of the same mean cosine 2/3, so that the product is again a mixture: of the same lobes with other
  /// weights, and each turned towards the normal.
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

  /// As seen from `p`: mean directions point from there to where the lights are.
  VmfLobes at(const Vec3& p) const;
  /// The same, written to another place up to the padding; what lies behind stays.
  void see_from(const Vec3& p, VmfLobes& written) const;
  /// The same lights with another pivot.
  VmfMixture moved_to(const Vec3& new_pivot) const;
};

}  // namespace covary
