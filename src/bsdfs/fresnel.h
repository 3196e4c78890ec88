// SPDX-License-Identifier: Apache-2.0
// Reflection and refraction at a smooth interface: exact unpolarised Fresnel equations for dielectrics and conductors
// ([BornWolf1999] sections 1.5 and 14.2), Schlick's approximation ([Schlick1994] Eq. (15)), and the hemispherical mean
// that layered diffuse models need.
//
// Indices are relative: `eta` = index of the side opposite the normal over the index of the side the normal points to.
#pragma once

#include "core/frame.h"
#include "core/spectrum.h"

namespace covary {

struct DielectricFresnel {
  float reflectance;  ///< fraction of power reflected; 1 for total internal reflection
  float cos_theta_t;  ///< cosine of the refracted direction, of opposite sign to cos_theta_i; 0 for total reflection
  float eta_it;       ///< relative index: transmitted side over incident side
  float eta_ti;       ///< its reciprocal: scale of the tangential components of the refracted direction
};

/// Reflectance between two dielectrics. `cos_theta_i` in [-1, 1] may have either sign: negative is incidence from the
/// side opposite the normal. `eta` > 0.
inline DielectricFresnel fresnel_dielectric(float cos_theta_i, float eta) {
  const bool outside = cos_theta_i >= 0;
  const float rcp_eta = 1 / eta;
  const float eta_it = outside ? eta : rcp_eta, eta_ti = outside ? rcp_eta : eta;
  // Snell's law: sin(theta_t) = eta_ti sin(theta_i).
  const float cos2_t = 1 - eta_ti * eta_ti * (1 - cos_theta_i * cos_theta_i);
  const float ci = std::abs(cos_theta_i), ct = safe_sqrt(cos2_t);
  const float cos_theta_t = outside ? -ct : ct;
  if (eta == 1) return {0, cos_theta_t, eta_it, eta_ti};
  if (ci == 0 || cos2_t <= 0) return {1, cos_theta_t, eta_it, eta_ti};
  // Amplitudes of the perpendicular and parallel components.
  const float rs = (ci - eta_it * ct) / (ci + eta_it * ct);
  const float rp = (eta_it * ci - ct) / (eta_it * ci + ct);
  return {0.5f * (rs * rs + rp * rp), cos_theta_t, eta_it, eta_ti};
}

/// Reflectance of a conductor with relative complex index eta + i k; `cos_theta_i` in [0, 1].
inline float fresnel_conductor(float cos_theta_i, float eta, float k) {
  const float cos2 = cos_theta_i * cos_theta_i, sin2 = 1 - cos2;
  // a^2 + b^2 and a, where (a + i b)^2 = (eta + i k)^2 - sin^2(theta_i).
  const float d = eta * eta - k * k - sin2;
  const float a2_b2 = safe_sqrt(d * d + 4 * eta * eta * k * k);
  const float a = safe_sqrt(0.5f * (a2_b2 + d));
  const float s = a2_b2 + cos2, t = 2 * a * cos_theta_i;
  const float rs = (s - t) / (s + t);
  const float u = a2_b2 * cos2 + sin2 * sin2, v = t * sin2;
  const float rp = rs * (u - v) / (u + v);
  return 0.5f * (rs + rp);
}

/// The same for each channel.
inline Spectrum fresnel_conductor(float cos_theta_i, const Spectrum& eta, const Spectrum& k) {
  return {fresnel_conductor(cos_theta_i, eta.r, k.r), fresnel_conductor(cos_theta_i, eta.g, k.g),
          fresnel_conductor(cos_theta_i, eta.b, k.b)};
}

/// (1 - cos_theta)^5, the weight of grazing reflection; cos_theta is clamped to [0, 1].
inline float schlick_weight(float cos_theta) {
  const float m = clamp01(1 - cos_theta);
  return sqr(sqr(m)) * m;
}
/// Reflectance at normal incidence between two dielectrics.
inline float schlick_r0(float eta) { return sqr((eta - 1) / (eta + 1)); }
/// Schlick's approximation with reflectance `r0` at normal incidence. `cos_theta_i` as in fresnel_dielectric; on the
/// denser side it uses the angle of the refracted ray, so that total internal reflection gives 1.
inline Spectrum fresnel_schlick(const Spectrum& r0, float cos_theta_i, float eta) {
  const float eta_it = cos_theta_i >= 0 ? eta : 1 / eta;
  const float c =
      eta_it > 1 ? std::abs(cos_theta_i) : safe_sqrt(1 - (1 - cos_theta_i * cos_theta_i) / (eta_it * eta_it));
  return lerp(schlick_weight(c), r0, Spectrum(1));
}

/// Cosine-weighted mean of fresnel_dielectric over the hemisphere. Two published fits, each used where it is the better
/// one; relative error below 0.2 % for eta in [0.5, 1] and [1, 5].
inline float fresnel_diffuse_reflectance(float eta) {
  const float r = 1 / eta;
  if (eta < 1) return -1.4399f * eta * eta + 0.7099f * eta + 0.6681f + 0.0636f * r;  // [Egan1973]
  // [dEon2011] appendix
  return 0.919317f + r * (-3.4793f + r * (6.75335f + r * (-7.80989f + r * (4.98554f - 1.36881f * r))));
}

/// Refracts `w` at the plane z = 0, given the results of fresnel_dielectric(w.z, eta).
inline Vec3 refract(const Vec3& w, float cos_theta_t, float eta_ti) {
  return {-eta_ti * w.x, -eta_ti * w.y, cos_theta_t};
}
/// Refracts `w` at a plane with unit normal `m`, given the results of fresnel_dielectric(dot(w, m), eta).
inline Vec3 refract(const Vec3& w, const Vec3& m, float cos_theta_t, float eta_ti) {
  return m * (dot(w, m) * eta_ti + cos_theta_t) - w * eta_ti;
}

}  // namespace covary
