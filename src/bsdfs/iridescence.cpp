// SPDX-License-Identifier: Apache-2.0
#include "bsdfs/iridescence.h"

#include "bsdfs/fresnel.h"

namespace covary {
namespace {

/// Fourier transform of the eye's sensitivities (CIE XYZ as sums of Gaussians) at an optical path difference in metres,
/// in linear Rec. 709 [BelcourBarla2017] Sec. 4 and its supplement. `shift`: phases of three channels.
Spectrum sensitivity(float path_difference, const Spectrum& shift) {
  const float phase = kTwoPi * path_difference, phase2 = phase * phase;
  const auto gaussian = [&](float value, float position, float variance, float shifted) {
    return value * std::sqrt(kTwoPi * variance) * std::cos(position * phase + shifted) * std::exp(-phase2 * variance);
  };
  constexpr float kNorm = 1.0685e-7f;
  const float x =
      (gaussian(5.4856e-13f, 1.6810e6f, 4.3278e9f, shift.r) + gaussian(9.7470e-14f, 2.2399e6f, 4.5282e9f, shift.r)) /
      kNorm;
  const float y = gaussian(4.4201e-13f, 1.7953e6f, 9.3046e9f, shift.g) / kNorm;
  const float z = gaussian(5.2481e-13f, 2.2084e6f, 6.6121e9f, shift.b) / kNorm;
  return {3.2404542f * x - 1.5371385f * y - 0.4985314f * z, -0.9692660f * x + 1.8760108f * y + 0.0415560f * z,
          0.0556434f * x - 0.2040259f * y + 1.0572252f * z};
}

float schlick(float r0, float cos_theta) { return r0 + (1 - r0) * schlick_weight(cos_theta); }

}  // namespace

Spectrum thin_film_reflectance(const Spectrum& f0, float film_ior, float thickness, float cos_theta) {
  // A film that vanishes has the index of air.
  const float fade = clamp01(thickness / 0.03f), film = lerp(fade * fade * (3 - 2 * fade), 1.0f, film_ior);
  const float cos2_squared = 1 - (1 - cos_theta * cos_theta) / (film * film);
  if (!(cos2_squared >= 0)) return Spectrum(1);
  const float cos2 = std::sqrt(cos2_squared);
  const float r12 = schlick(schlick_r0(film), cos_theta), t121 = 1 - r12, phase21 = film < 1 ? 0 : kPi;
  Spectrum r23, phase;
  for (int c = 0; c < 3; ++c) {
    const float root = std::sqrt(std::min(std::max(f0[c], 0.0f), 0.9999f)), base = (1 + root) / (1 - root);
    r23[c] = schlick(schlick_r0(base / film), cos2);
    phase[c] = phase21 + (base < film ? kPi : 0);
  }
  const float difference = 2 * film * thickness * 1e-9f * cos2;
  Spectrum r123, rs;
  for (int c = 0; c < 3; ++c) {
    const float r = std::min(std::max(r12 * r23[c], 1e-5f), 0.9999f);
    r123[c] = std::sqrt(r), rs[c] = t121 * t121 * r23[c] / (1 - r);
  }
  Spectrum reflected = Spectrum(r12) + rs, order = rs - Spectrum(t121);
  for (int m = 1; m <= 2; ++m) {
    order = order * r123;
    reflected += order * sensitivity(static_cast<float>(m) * difference, phase * static_cast<float>(m)) * 2;
  }
  return {std::max(reflected.r, 0.0f), std::max(reflected.g, 0.0f), std::max(reflected.b, 0.0f)};
}

}  // namespace covary
