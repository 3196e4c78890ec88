// SPDX-License-Identifier: Apache-2.0
// Microfacet distributions (GGX and Beckmann, anisotropic) after [Walter2007], with Smith masking and exact sampling of
// the visible normals ([Heitz2014], [HeitzDEon2014], [Dupuy2023]).
//
//   code            paper
//   alpha_u/v       alpha_x, alpha_y     roughness along the s and t axis of the shading frame
//   eval(m)         D(m)
//   smith_g1(w, m)  G1(w, m)
//   pdf(w, m)       D_w(m) = G1(w, m) |w.m| D(m) / cos(theta_w)
#pragma once

#include "core/frame.h"
#include "core/trigonometry.h"

namespace covary {

enum class MicrofacetType : uint8_t { kBeckmann, kGgx };

class Microfacet {
 public:
  /// Roughness is clamped to at least 1e-4.
  Microfacet(MicrofacetType type, float alpha_u, float alpha_v)
      : alpha_u_(std::max(alpha_u, 1e-4f)), alpha_v_(std::max(alpha_v, 1e-4f)), type_(type) {}

  MicrofacetType type() const { return type_; }
  float alpha_u() const { return alpha_u_; }
  float alpha_v() const { return alpha_v_; }

  /// Density of normals D(m): area of microfacets per unit solid angle of m and unit area of the surface; D(m)
  /// cos(theta_m) integrates to 1. Zero below the surface and where negligible (D cos < 1e-20).
  float eval(const Vec3& m) const {
    const float slope2 = sqr(m.x / alpha_u_) + sqr(m.y / alpha_v_), cos2 = m.z * m.z;
    const float norm = kPi * alpha_u_ * alpha_v_;
    const float d = type_ == MicrofacetType::kGgx ? 1 / (norm * sqr(slope2 + cos2))  // [Walter2007] Eq. (33)
                                                  : std::exp(-slope2 / cos2) / (norm * sqr(cos2));  // Eq. (25)
    return d * m.z > 1e-20f ? d : 0;
  }

  /// Fraction of the microfacets with normal m that are visible from w; 0 if w sees the back of either surface. If w is
  /// in the lower hemisphere, m is still the upward normal and its lower side is meant.
  float smith_g1(const Vec3& w, const Vec3& m) const { return dot(w, m) * w.z > 0 ? smith_g1(w) : 0; }
  /// The same without the orientation test; independent of m.
  float smith_g1(const Vec3& w) const {
    const float xy2 = sqr(alpha_u_ * w.x) + sqr(alpha_v_ * w.y), z = std::abs(w.z);
    return type_ == MicrofacetType::kGgx ? 2 * z / (z + std::sqrt(z * z + xy2)) : beckmann_g1(xy2, z);
  }
  /// Separable masking and shadowing, G1(wi, m) G1(wo, m).
  float smith_g(const Vec3& wi, const Vec3& wo, const Vec3& m) const { return smith_g1(wi, m) * smith_g1(wo, m); }

  /// G1(w) / cos(theta_w) without dividing two small numbers; finite up to grazing w for GGX. `w.z` > 0.
  float smith_g1_over_cos(const Vec3& w) const {
    if (type_ == MicrofacetType::kBeckmann) return smith_g1(w) / w.z;
    return 2 / (w.z + std::sqrt(w.z * w.z + sqr(alpha_u_ * w.x) + sqr(alpha_v_ * w.y)));
  }

  /// Density of sample(): visible normals for w, per unit solid angle of m. `w.z` > 0.
  float pdf(const Vec3& w, const Vec3& m) const {
    const float wm = dot(w, m);
    return wm * w.z > 0 ? eval(m) * smith_g1_over_cos(w) * wm : 0;
  }

  struct Sample {
    Vec3 m;
    float pdf;  ///< per unit solid angle of m
  };
  /// Samples a normal visible from w (`w.z` > 0), continuous in u. For GGX also continuous in w; for Beckmann except at
  /// w = (0, 0, 1).
  Sample sample(const Vec3& w, Vec2 u) const {
    const Vec3 m = type_ == MicrofacetType::kGgx ? sample_ggx(w, u) : sample_beckmann(w, u);
    return {m, pdf(w, m)};
  }

 private:
  // [Dupuy2023]: the visible normals of a hemisphere are the half vectors of w and directions distributed uniformly on
  // the spherical cap z > -w.z. Other roughnesses stretch the hemisphere.
  Vec3 sample_ggx(const Vec3& w, Vec2 u) const {
    const Vec3 v = normalize({alpha_u_ * w.x, alpha_v_ * w.y, w.z});
    const SinCos phi = sincos_turns(u.x);
    const float z = (1 - u.y) * (1 + v.z) - v.z;
    const float r = safe_sqrt(1 - z * z);
    const Vec3 h{r * phi.cos + v.x, r * phi.sin + v.y, z + v.z};
    return normalize({alpha_u_ * h.x, alpha_v_ * h.y, std::max(h.z, 1e-9f)});
  }
  Vec3 sample_beckmann(const Vec3& w, Vec2 u) const;
  /// `xy2`: squared tangential part of w, scaled by roughness; `z`: cosine of w.
  static float beckmann_g1(float xy2, float z);

  float alpha_u_, alpha_v_;
  MicrofacetType type_;
};

/// Inverse of the error function on (-1, 1), relative error about 1e-6 ([Giles2012] Table 5).
float erf_inv(float x);

}  // namespace covary
