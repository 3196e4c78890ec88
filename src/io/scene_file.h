// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "formats/xml_reader.h"

namespace covary {

/// Whether a file of this name is read as a pbrt-v4 scene.
inline bool is_pbrt_file(std::string_view name) { return name.ends_with(".pbrt"); }
/// Whether a file of this name is read as a glTF 2.0 scene.
inline bool is_gltf_file(std::string_view name) { return name.ends_with(".gltf") || name.ends_with(".glb"); }
/// Whether a file of this name is a scene, rather than an image or something else.
inline bool is_scene_file(std::string_view name) {
  return name.ends_with(".xml") || is_pbrt_file(name) || is_gltf_file(name);
}

/// Reads the text of a scene file in the format given by its name; see read_scene_xml(). `time` as for
/// read_scene_gltf(). Throws Error(kInput) with all
/// problems if no scene results, and Error(kUsage) for defines that the format cannot use.
SceneXml read_scene_file(std::string_view text, const std::string& name,
                         const std::map<std::string, std::string>& defines, FileResolver& files,
                         Diagnostics& diagnostics, std::optional<double> time = std::nullopt);

}  // namespace covary
