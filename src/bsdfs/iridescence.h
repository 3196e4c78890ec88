// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/spectrum.h"

namespace covary {

/// Reflectance of a surface of reflectance `f0` at normal incidence under a thin film of index `film_ior` and
/// `thickness` nanometres, in air, for the cosine `cos_theta` in [0, 1] [BelcourBarla2017], with the approximations of
/// the extension KHR_materials_iridescence: Schlick's reflectance at both interfaces, two orders of interference. Not
/// negative; may exceed 1 a little in some colours.
Spectrum thin_film_reflectance(const Spectrum& f0, float film_ior, float thickness, float cos_theta);

}  // namespace covary
