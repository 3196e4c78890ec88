// SPDX-License-Identifier: Apache-2.0
// Terms shared by `principled` and `principledthin`, from [Burley2012] and its extension [Burley2015].
#pragma once

#include <fmt/format.h>

#include "bsdfs/fresnel.h"
#include "bsdfs/inputs.h"
#include "bsdfs/microfacet.h"

namespace covary {

/// A number in [0, highest]: textures are clamped; constants out of range are an error.
inline NumberInput get_fraction(Parameters& parameters, const std::string& name, float fallback, float highest = 1) {
  NumberInput input(parameters.get_texture(name, fallback));
  if (input.is_constant() && !(input.constant() >= 0 && input.constant() <= highest))
    parameters.error_at(name, fmt::format("is {}; expected a number in [0, {}]", input.constant(), highest));
  return input;
}

/// GGX with the roughness of [Burley2012] section 5.4: alpha = roughness^2, stretched so that the area of highlights is
/// kept.
inline Microfacet principled_distribution(float roughness, float anisotropic) {
  const float aspect = std::sqrt(1 - 0.9f * anisotropic), alpha = sqr(roughness);
  return {MicrofacetType::kGgx, std::max(0.001f, alpha / aspect), std::max(0.001f, alpha * aspect)};
}

/// The colour scaled to unit luminance: its hue and saturation; white for black.
inline Spectrum principled_tint(const Spectrum& colour) {
  const float l = luminance(colour);
  return l > 0 ? colour / l : Spectrum(1);
}

/// Diffuse reflection with retro-reflection ([Burley2012] section 5.3), blended by `flatness` with an approximation of
/// Hanrahan-Krueger subsurface scattering, relative to a Lambertian. `cos_d`: cosine between wi and the half vector.
inline float principled_diffuse(float cos_o, float cos_i, float cos_d, float roughness, float flatness) {
  const float w_o = schlick_weight(cos_o), w_i = schlick_weight(cos_i);
  const float rr = 2 * roughness * sqr(cos_d);
  const float diffuse = (1 - 0.5f * w_o) * (1 - 0.5f * w_i) + rr * (w_o + w_i + w_o * w_i * (rr - 1));
  if (flatness == 0) return diffuse;
  const float f_ss90 = 0.5f * rr;
  const float f_ss = lerp(w_o, 1, f_ss90) * lerp(w_i, 1, f_ss90);
  return lerp(flatness, diffuse, 1.25f * (f_ss * (1 / (cos_o + cos_i) - 0.5f) + 0.5f));
}

}  // namespace covary
