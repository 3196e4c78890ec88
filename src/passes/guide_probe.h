// SPDX-License-Identifier: Apache-2.0
// What an integrator that guides paths knows at a surface, as functions of the direction: latitude-longitude images
// around the y axis.
#pragma once

#include "film/film.h"

namespace covary {

/// Row 0 is +y. Column 0 begins at +x and turns towards +z.
struct GuideProbe {
  Vec3 position;
  Image radiance;  ///< that arrives, by brute force
  Image density;   ///< per unit solid angle, with which the next direction is drawn, delta lobes excluded; grey
  Image control;  ///< Σ_k β_k N_k λ_k of the leaf's control variate per unit solid angle, scaled; RGB, can be negative
};

/// Direction of the point (x, y) of a probe's image, in [0, 1]².
Vec3 probe_direction(float x, float y);

}  // namespace covary
