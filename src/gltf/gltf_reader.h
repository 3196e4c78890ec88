// SPDX-License-Identifier: Apache-2.0
// glTF 2.0 files -> ObjectDescription trees, as from Mitsuba XML (xml_reader.h).
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "formats/xml_reader.h"

namespace covary {

/// The id of the emission of materials that are to appear as they are painted.
inline constexpr const char* kUnlit = "unlit";

/// Reads the file, JSON or binary, with its buffers and images; see read_scene_xml(). `time`: of its animations, in
/// seconds; nullopt: all is at rest.
SceneXml read_scene_gltf(std::string_view bytes, const std::string& name, FileResolver& files, Diagnostics& diagnostics,
                         std::optional<double> time);

}  // namespace covary
