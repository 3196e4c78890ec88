// SPDX-License-Identifier: Apache-2.0
// Mitsuba XML -> ObjectDescription trees: parameters substituted, includes read, references resolved, files of version
// 0.x and 1.x upgraded (upgrade.h). Objects are not interpreted here.
#pragma once

#include <map>
#include <memory>
#include <string>

#include "formats/file_resolver.h"
#include "scene/parameters.h"

namespace covary {

struct SceneXml {
  /// The <scene> element; its properties are the objects of the scene in file order. Null if the XML is malformed.
  std::shared_ptr<const ObjectDescription> scene;
  /// Hash of the text of all XML files read, and of the defines.
  uint64_t hash = 0;
  /// The file has animations of its own, and is read again for each time (glTF).
  bool is_animated = false;
};

/// Reads the XML `text` and every file it includes. `name` is used as its file name in messages, and its folder is
/// searched first for files. Problems go to `diagnostics`; search folders of the scene's files are added to `files`.
SceneXml read_scene_xml(std::string_view text, const std::string& name,
                        const std::map<std::string, std::string>& defines, FileResolver& files,
                        Diagnostics& diagnostics);

}  // namespace covary
