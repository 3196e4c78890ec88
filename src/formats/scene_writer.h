// SPDX-License-Identifier: Apache-2.0
// Writes ObjectDescription trees from any scene format as Mitsuba XML, which xml_reader.h reads back into the same
// trees.
#pragma once

#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "scene/parameters.h"

namespace covary {

/// A file that the scene needs in addition to its own: a mesh, an image.
struct SceneDocumentFile {
  std::string path;        ///< as used in the scene's file, relative to its folder
  std::string_view bytes;  ///< valid as long as the description
};

struct SceneDocument {
  std::string xml;
  std::vector<SceneDocumentFile> files;
  std::deque<std::string> recoded;  ///< content of re-encoded files
};

/// A file re-encoded in another format.
struct RecodedFile {
  std::string bytes;
  const char* extension;  ///< ".png"
};

struct SceneWriting {
  std::string comment;  ///< written at the start of the file
  /// Folder, relative to the new file's, for data embedded in the scene's own file; files in it are named by content
  /// hash.
  std::string folder;
  /// Name in the new file for a file of the scene; `where` is the object that references it.
  std::function<std::string(const std::string& name, const SourceLocation& where)> file_name;
  /// The new format for an image embedded in the scene's file; nullopt keeps its format.
  std::function<std::optional<RecodedFile>(std::string_view bytes)> recode;
};

/// The scene in format version 3.0.0. Numbers have enough digits to be read back exactly. Objects referenced more than
/// once get an id and come before their users; emitters are repeated for each shape, because in Mitsuba each shape has
/// its own emitter. Objects that could not be read are dropped: the scene must have no errors.
SceneDocument scene_document(const ObjectDescription& scene, const SceneWriting& writing);

}  // namespace covary
