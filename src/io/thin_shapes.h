// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "scene/scene.h"

namespace covary {

/// Appends warnings of shapes that are thin for where they stand: at some of a few points, their thickness is less than
/// kMinSpacings spacings of floats there, so that rays may miss a side of them. Shapes that light passes are also
/// named if their diameter is less than kMinAcross spacings: rays that leave them may miss another surface that they
/// meet, over a thirty-second of them and more where the angle is 45 degrees. `name_of` gives a shape's place in the
/// file and its type. At most four warnings. Shapes are probed that are far from the origin for their size: within 32
/// of their diameters, only a thickness of less than about 1e-4 of the diameter could be lost. Linear curves in groups
/// whose segments are too short for the ray tracer are named, too.
void warn_of_thin_shapes(const Scene& scene, const std::function<std::string(const Shape&)>& name_of,
                         std::vector<std::string>& warnings);

inline constexpr float kMinSpacings = 20, kMinAcross = 32 * kMinSpacings;

}  // namespace covary
