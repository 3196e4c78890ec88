// SPDX-License-Identifier: Apache-2.0
// Mitsuba XML -> ObjectDescription trees: parameters substituted, includes read, references resolved, files of version
// 0.x and 1.x brought to today's names (upgrade.h). What the objects mean is not decided here.
#pragma once

#include <map>
#include <memory>
#include <string>

#include "io/file_resolver.h"
#include "scene/parameters.h"

namespace covary {

struct SceneXml {
  /// The <scene> element; its properties are the objects of the scene in file order. Null when the XML is malformed.
  std::shared_ptr<const ObjectDescription> scene;
  /// Over the text of every XML file read and the defines.
  uint64_t hash = 0;
};

/// Reads `path` and everything it includes. Problems go to `diagnostics`; Error(kIo) when `path` cannot be read.
/// `files` gets the folders in which the scene's files are to be searched.
SceneXml read_scene_xml(const std::string& path, const std::map<std::string, std::string>& defines, FileResolver& files,
                        Diagnostics& diagnostics);

/// The same for XML in memory; `name` is used in messages and its folder for relative files.
SceneXml read_scene_xml_text(std::string_view text, const std::string& name,
                             const std::map<std::string, std::string>& defines, FileResolver& files,
                             Diagnostics& diagnostics);

}  // namespace covary
