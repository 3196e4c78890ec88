// SPDX-License-Identifier: Apache-2.0
// The media that shapes and sensors of scene files name.
#pragma once

#include <string>

#include "scene/parameters.h"
#include "scene/scene.h"

namespace covary {

struct ShapeMedia {
  MediumPtr interior, exterior;
};

/// Mitsuba's path tracers that see media, `volpath` and `volpathmis`, are `path` here.
void name_path(ObjectDescription& integrator);
/// Whether a <kind> may stand at top level to be referred to.
bool is_part_of_media(const std::string& kind);
/// What the shape of these parameters names. Shapes of a group may have none.
ShapeMedia read_media(Parameters& shape, bool in_group);
/// Gives them to the shape, and tells the scene. `no_bsdf`: the shape names none.
void use_media(const ShapeMedia& media, Parameters& parameters, Shape& shape, bool no_bsdf, SceneParts& parts);
void use_camera_medium(const MediumPtr& medium, const ObjectDescription& sensor, SceneParts& parts);

}  // namespace covary
