// SPDX-License-Identifier: Apache-2.0
// Mitsuba XML -> ObjectDescription trees: parameters substituted, includes read, references resolved, files of version
// 0.x and 1.x upgraded (upgrade.h). The meaning of the objects is not decided here.
#pragma once

#include <map>
#include <memory>
#include <string>

#include "formats/file_resolver.h"
#include "scene/parameters.h"

namespace covary {

struct SceneXml {
  /// The <scene> element; its properties are the objects of the scene in file order. Null when the XML is malformed.
  std::shared_ptr<const ObjectDescription> scene;
  /// Over the text of every XML file read and the defines.
  uint64_t hash = 0;
};

/// Reads the XML `text` and every file it includes. `name` stands for the text in messages, and its folder is searched
/// first for files. Problems go to `diagnostics`; `files` gets the folders in which the scene's files are searched.
SceneXml read_scene_xml(std::string_view text, const std::string& name,
                        const std::map<std::string, std::string>& defines, FileResolver& files,
                        Diagnostics& diagnostics);

}  // namespace covary
