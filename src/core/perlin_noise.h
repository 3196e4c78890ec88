// SPDX-License-Identifier: Apache-2.0
// Perlin's improved noise [Perlin2002], and sums of it, as pbrt has them (util/noise.cpp).
#pragma once

#include "core/vec.h"

namespace covary {

/// Zero at points of the integer lattice, in about (-1, 1); repeats after 256.
float perlin_noise(const Vec3& p);
/// `count` octaves, each 1.99 times as fine as the last and `omega` times as strong.
float fractal_noise(const Vec3& p, float omega, int count);
/// The same of absolute values, with a mean of 0.2 for what is left of the octave after the last.
float turbulence(const Vec3& p, float omega, int count);

}  // namespace covary
