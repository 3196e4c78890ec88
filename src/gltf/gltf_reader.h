// SPDX-License-Identifier: Apache-2.0
// Files of glTF 2.0 -> ObjectDescription trees, like those that Mitsuba's XML becomes (xml_reader.h).
#pragma once

#include <string>
#include <string_view>

#include "formats/xml_reader.h"

namespace covary {

/// Reads the file, JSON or binary, with its buffers and images; as read_scene_xml().
SceneXml read_scene_gltf(std::string_view bytes, const std::string& name, FileResolver& files,
                         Diagnostics& diagnostics);

}  // namespace covary
