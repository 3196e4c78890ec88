// SPDX-License-Identifier: Apache-2.0
#include "io/scene_file.h"

#include <fmt/format.h>

#include "gltf/gltf_reader.h"
#include "pbrt/pbrt_reader.h"

namespace covary {

SceneXml read_scene_file(std::string_view text, const std::string& name,
                         const std::map<std::string, std::string>& defines, FileResolver& files,
                         Diagnostics& diagnostics, std::optional<double> time) {
  SceneXml result;
  const bool pbrt = is_pbrt_file(name), gltf = is_gltf_file(name);
  if ((pbrt || gltf) && !defines.empty())
    throw Error(ErrorCode::kUsage,
                fmt::format("{}: scenes of {} have no parameters to define", name, pbrt ? "pbrt" : "glTF"));
  if (pbrt)
    result = read_scene_pbrt(text, name, files, diagnostics);
  else if (gltf)
    result = read_scene_gltf(text, name, files, diagnostics, time);
  else
    result = read_scene_xml(text, name, defines, files, diagnostics);
  if (result.scene) return result;
  diagnostics.throw_if_errors();
  throw Error(ErrorCode::kInput, name + ": the file holds no scene");
}

}  // namespace covary
