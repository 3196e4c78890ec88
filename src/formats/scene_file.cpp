// SPDX-License-Identifier: Apache-2.0
#include "formats/scene_file.h"

#include "formats/pbrt_reader.h"

namespace covary {

SceneXml read_scene_file(std::string_view text, const std::string& name,
                         const std::map<std::string, std::string>& defines, FileResolver& files,
                         Diagnostics& diagnostics) {
  SceneXml result;
  if (!is_pbrt_file(name))
    result = read_scene_xml(text, name, defines, files, diagnostics);
  else if (defines.empty())
    result = read_scene_pbrt(text, name, files, diagnostics);
  else
    throw Error(ErrorCode::kUsage, name + ": scenes of pbrt have no parameters to define");
  if (result.scene) return result;
  diagnostics.throw_if_errors();
  throw Error(ErrorCode::kInput, name + ": the file holds no scene");
}

}  // namespace covary
