// SPDX-License-Identifier: Apache-2.0
// What a Mitsuba scene without a sensor of its own shows.
#pragma once

#include "core/ray.h"
#include "scene/parameters.h"

namespace covary {

/// The sensor that Mitsuba gives such a scene, told: 45 degrees across the largest side of the box, along the z axis.
/// An error if a shape holds a sensor, which measures a number.
ObjectPtr default_sensor(const ObjectDescription& scene, const Bounds3& bounds, Diagnostics& diagnostics);

/// Told of other files without a camera.
inline constexpr const char* kFramed = "the file has no camera: everything is framed, from the front";

}  // namespace covary
