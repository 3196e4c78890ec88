// SPDX-License-Identifier: Apache-2.0
// A neutral photographic studio: a floor that merges into the background at the horizon, a large key light from
// the upper left, a weak fill light from the right, and a rim light from behind.
#pragma once

#include <string>

namespace covary {

inline constexpr float kStudioFloor = 0.4f;    ///< reflectance of the floor
inline constexpr float kStudioHorizon = 0.3f;  ///< radiance at the horizon, and of the unshadowed floor

/// The light from above the floor, and below the horizon what the floor would reflect: an image by latitude and
/// longitude as a PFM file; y is up, z towards the viewer, x to the viewer's right.
std::string studio_environment();

}  // namespace covary
