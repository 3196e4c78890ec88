// SPDX-License-Identifier: Apache-2.0
// Media referenced by shapes and sensors in scene files.
#pragma once

#include <string>

#include "scene/parameters.h"
#include "scene/scene.h"

namespace covary {

struct ShapeMedia {
  MediumPtr interior, exterior;
};

/// Mitsuba's volumetric path tracers, `volpath` and `volpathmis`, become `path` here; `bdpt` of a scene with media too,
/// with a warning, since ours sees none.
void name_path(ObjectDescription& integrator, const ObjectDescription& scene, Diagnostics& diagnostics);
/// Whether a shape or the sensor is in a medium.
bool has_media(const ObjectDescription& scene);
/// Whether a <kind> may stand at top level to be referenced.
bool is_part_of_media(const std::string& kind);
/// The media that a shape references. Shapes in a group must have none.
ShapeMedia read_media(Parameters& shape, bool in_group);
/// Assigns the media to the shape and registers them with the scene. `no_bsdf`: the shape specifies no BSDF.
void use_media(const ShapeMedia& media, Parameters& parameters, Shape& shape, bool no_bsdf, SceneParts& parts);
void use_camera_medium(const MediumPtr& medium, const ObjectDescription& sensor, SceneParts& parts);

}  // namespace covary
