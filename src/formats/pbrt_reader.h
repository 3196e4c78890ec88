// SPDX-License-Identifier: Apache-2.0
// Scene files of pbrt-v4 -> ObjectDescription trees, like those that Mitsuba's XML becomes (xml_reader.h).
#pragma once

#include <string>
#include <string_view>

#include "formats/xml_reader.h"

namespace covary {

/// Reads the scene `text` and every file it includes; as read_scene_xml().
SceneXml read_scene_pbrt(std::string_view text, const std::string& name, FileResolver& files, Diagnostics& diagnostics);

}  // namespace covary
