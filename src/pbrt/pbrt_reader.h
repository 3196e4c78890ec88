// SPDX-License-Identifier: Apache-2.0
// pbrt-v4 scene files -> ObjectDescription trees, as from Mitsuba XML (xml_reader.h).
#pragma once

#include <string>
#include <string_view>

#include "formats/xml_reader.h"

namespace covary {

/// Reads the scene `text` and every file it includes; see read_scene_xml().
SceneXml read_scene_pbrt(std::string_view text, const std::string& name, FileResolver& files, Diagnostics& diagnostics);

}  // namespace covary
