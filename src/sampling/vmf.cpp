// SPDX-License-Identifier: Apache-2.0
#include "sampling/vmf.h"

#include "core/frame.h"
#include "core/trigonometry.h"

namespace covary::vmf {

Vec3 sample(const Vmf& lobe, Vec2 u) {
  // Invert the distribution of 1 − cos θ, without losing precision at small angles.
  const float t = lobe.kappa < 1e-5f ? 2 * u.y : -std::log1p(u.y * std::expm1(-2 * lobe.kappa)) / lobe.kappa;
  const float one_minus_cos = std::clamp(t, 0.0f, 2.0f);
  const float sin = safe_sqrt(one_minus_cos * (2 - one_minus_cos));
  const SinCos phi = sincos_turns(u.x);
  return normalize(Frame(lobe.mean).to_world({sin * phi.cos, sin * phi.sin, 1 - one_minus_cos}));
}

double one_minus_mean_cosine(double kappa) {
  if (kappa < 0.02) return 1 - kappa / 3 * (1 - kappa * kappa / 15);
  return 1 / kappa - 2 / std::expm1(2 * kappa);
}

double kappa_of(double q) {
  if (!(q < 1)) return 0;
  if (q <= 1.0 / kMaxKappa) return kMaxKappa;
  const double r = 1 - q;
  double kappa = r * (3 - r * r) / (q * (2 - q));  // [Banerjee2005] Eq. (4.4), then Newton's method
  for (int i = 0; i < 4; ++i) {
    const double s = std::sinh(std::min(kappa, 300.0));
    const double slope = kappa < 0.02 ? -1.0 / 3 : 1 / (s * s) - 1 / (kappa * kappa);
    kappa = std::max(kappa - (one_minus_mean_cosine(kappa) - q) / slope, 0.0);
  }
  return std::min<double>(kappa, kMaxKappa);
}

double log_integral_of_exponential(double length) {
  // 4π sinh(k) / k
  if (length < 1e-4) return std::log(4 * M_PI) + length * length / 6;
  return length + std::log(2 * M_PI * -std::expm1(-2 * length) / length);
}

}  // namespace covary::vmf
