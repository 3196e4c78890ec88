// SPDX-License-Identifier: Apache-2.0
#include "bsdfs/microfacet.h"

namespace covary {

namespace {
constexpr float kInvSqrtPi = 0.56418958354775628695f;
}

float erf_inv(float x) {
  // [Giles2012] Table 5, single precision
  float w = -std::log((1 - x) * (1 + x)), p;
  if (w < 5) {
    w -= 2.5f;
    p = 2.81022636e-08f;
    for (const float c : {3.43273939e-07f, -3.5233877e-06f, -4.39150654e-06f, 0.00021858087f, -0.00125372503f,
                          -0.00417768164f, 0.246640727f, 1.50140941f})
      p = c + p * w;
  } else {
    w = std::sqrt(w) - 3;
    p = -0.000200214257f;
    for (const float c : {0.000100950558f, 0.00134934322f, -0.00367342844f, 0.00573950773f, -0.0076224613f,
                          0.00943887047f, 1.00167406f, 2.83297682f})
      p = c + p * w;
  }
  return p * x;
}

float Microfacet::beckmann_g1(float xy2, float z) {
  if (xy2 == 0) return 1;
  const float a = z / std::sqrt(xy2);  // 1 / (alpha tan(theta))
  if (a > 4) return 1;
  // [Walter2007] Eq. (26), exact. With the rational fit of Eq. (27) (0.35 % off), the density of visible normals, which
  // must match sample_beckmann(), would not integrate to one.
  return 2 / (1 + std::erf(a) + kInvSqrtPi * std::exp(-a * a) / a);
}

// [HeitzDEon2014]: sample the visible slopes of the unit-roughness surface, then rotate and stretch. The slope along w
// is found by inverting its CDF
//     C(x) = 1 + x + tan(theta) exp(-erfinv(x)^2) / sqrt(pi),  x = erf(slope) in (-1, erf(cot theta)),
// with Newton's method from the solution for grazing incidence ([Jakob2014]): monotone and continuous in u.
Vec3 Microfacet::sample_beckmann(const Vec3& w, Vec2 u) const {
  const Vec3 v = normalize({alpha_u_ * w.x, alpha_v_ * w.y, w.z});
  const float sin_v = std::sqrt(v.x * v.x + v.y * v.y);
  const float cos_phi = sin_v > 0 ? v.x / sin_v : 1, sin_phi = sin_v > 0 ? v.y / sin_v : 0;
  u = {std::clamp(u.x, 1e-6f, 1 - 1e-6f), std::clamp(u.y, 1e-6f, 1 - 1e-6f)};

  const float tan_v = sin_v / v.z, cot_v = v.z / sin_v;  // cot may be infinite; erf and exp handle it
  const float x_max = std::erf(cot_v);
  const float target = u.x * (1 + x_max + kInvSqrtPi * tan_v * std::exp(-cot_v * cot_v));
  float x = x_max - (x_max + 1) * std::erf(std::sqrt(-std::log(u.x)));
  for (int i = 0; i < 3; ++i) {
    const float slope = erf_inv(x);
    const float value = 1 + x + kInvSqrtPi * tan_v * std::exp(-slope * slope) - target;
    x = std::clamp(x - value / (1 - slope * tan_v), -1 + 1e-6f, 1 - 1e-6f);
  }
  const float along = erf_inv(x), across = erf_inv(2 * u.y - 1);
  return normalize(
      {-alpha_u_ * (cos_phi * along - sin_phi * across), -alpha_v_ * (sin_phi * along + cos_phi * across), 1});
}

}  // namespace covary
