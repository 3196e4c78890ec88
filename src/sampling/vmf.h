// SPDX-License-Identifier: Apache-2.0
// The von Mises-Fisher distribution of directions, with density
//
//     v(w) = N(κ) e^{κ (cos θ − 1)},     N(κ) = κ / (2π (1 − e^{−2κ})),
//
// per unit solid angle, where θ is the angle between w and the mean direction, and κ ≥ 0 the concentration; κ = 0 is
// uniform. All functions are accurate for κ from 0 to far above kMaxKappa: densities use 1 − cos θ = |w − mean|² / 2,
// which does not cancel near the mean.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>

#include "core/vec.h"

namespace covary {

struct Vmf {
  Vec3 mean{0, 0, 1};  ///< unit vector
  float kappa = 0;     ///< concentration, 0 to kMaxKappa
};

/// Largest concentration that fits produce: lobes about 0.1 degrees wide.
inline constexpr float kMaxKappa = 3.2e5f;

namespace vmf {

/// e^x for x <= 0 by a Taylor series of 2^f, relative error below 1e-6 if the result is a normal number; 0 below e^-87.
/// Inlined into loops over lobes, which compilers vectorise; bit-identical on all machines.
inline float exp_nonpositive(float x) {
  const float y = std::max(x, -87.0f) * 1.44269504088896341f;
  const float n = std::nearbyint(y), f = y - n;
  float p = 1.54035304e-4f;
  p = p * f + 1.33335581e-3f;
  p = p * f + 9.61812911e-3f;
  p = p * f + 5.55041087e-2f;
  p = p * f + 0.240226507f;
  p = p * f + 0.693147181f;
  p = p * f + 1;
  const uint32_t bits = static_cast<uint32_t>(static_cast<int32_t>(n) + 127) << 23;
  float scale;
  std::memcpy(&scale, &bits, sizeof scale);
  return x < -87 ? 0 : p * scale;
}

/// N(κ), the density in the mean direction.
inline float peak(float kappa) {
  const float series = 0.5f * (1 + kappa * (1 + kappa * (1.0f / 3 - kappa * kappa * (1.0f / 45))));
  const float ratio = kappa / (1 - exp_nonpositive(-2 * std::max(kappa, 0.25f)));
  return (kappa < 0.25f ? series : ratio) * (0.5f * kInvPi);
}

/// Density at the unit vector `w`.
inline float pdf(const Vmf& lobe, const Vec3& w) {
  return peak(lobe.kappa) * exp_nonpositive(-0.5f * lobe.kappa * length_squared(w - lobe.mean));
}

/// Samples a direction with this density from a point of [0, 1)².
Vec3 sample(const Vmf& lobe, Vec2 u);

/// 1 − E[cos θ] = 1 − coth κ + 1/κ, in (0, 1].
double one_minus_mean_cosine(double kappa);
/// The concentration with this 1 − E[cos θ]: the maximum-likelihood estimate for directions with such a mean. 0 for
/// arguments of 1 and more, at most kMaxKappa.
double kappa_of(double one_minus_mean_cosine);

/// log ∫ e^{k · w} dw over the sphere, for |k| = `length`.
double log_integral_of_exponential(double length);

}  // namespace vmf
}  // namespace covary
