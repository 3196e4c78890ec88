// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "scene/camera.h"
#include "scene/parameters.h"

namespace covary {

struct FieldOfView {
  float degrees = 50;
  FovAxis axis = FovAxis::kX;
};

/// Reads the parameters `fov` with `fov_axis`, or `focal_length`, of a camera-like object.
FieldOfView get_field_of_view(Parameters& parameters);

}  // namespace covary
