// SPDX-License-Identifier: Apache-2.0
// Lamps in the albedo of renders. Most renderers give a lamp the albedo of its material, often that of the ceiling or
// wall around it, so that no feature tells where it ends, and a denoiser spreads its light over the edge.
#pragma once

#include "film/film.h"

namespace covary {

/// Darkens the albedo (3 channels) where one render, `picture`, shows a lamp: pixels more than kLampBrightness times as
/// bright as the median, and equal to their eight neighbours but for kLampNoise, become black. So does the part of a
/// pixel beside them that the lamp covers, as far as its brightness tells. Does nothing if sizes differ.
void darken_lamps(const Image& picture, Image& albedo);

inline constexpr float kLampBrightness = 8, kLampNoise = 0.01f;

}  // namespace covary
