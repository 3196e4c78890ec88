// SPDX-License-Identifier: Apache-2.0
// Directional albedos of GGX reflection with Schlick's reflectance F = f0 + (f90 - f0) w, w = (1 - cos)^5 at the
// microfacet, from tables that are computed once.
#pragma once

namespace covary {

struct SchlickAlbedo {
  float at_f0, at_f90;  ///< the albedo is f0 at_f0 + f90 at_f90
  float reflected(float f0, float f90) const { return f0 * at_f0 + f90 * at_f90; }
};

/// Of GGX with alpha = roughness^2 and separable masking, seen under the cosine `mu`; both in [0, 1]. Within 0.003.
SchlickAlbedo schlick_specular_albedo(float mu, float roughness);

/// Of a white Lambertian surface times F at the half vector. Within 0.001.
SchlickAlbedo schlick_diffuse_albedo(float mu);

}  // namespace covary
