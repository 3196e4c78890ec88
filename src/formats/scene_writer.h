// SPDX-License-Identifier: Apache-2.0
// ObjectDescription trees, of whatever scene file, as Mitsuba's XML: what xml_reader.h reads into the same trees.
#pragma once

#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "scene/parameters.h"

namespace covary {

/// A file that the scene needs beside its own: a mesh, an image.
struct SceneDocumentFile {
  std::string path;        ///< as the scene's file names it, relative to its folder
  std::string_view bytes;  ///< lives as long as the description
};

struct SceneDocument {
  std::string xml;
  std::vector<SceneDocumentFile> files;
  std::deque<std::string> recoded;  ///< bytes of files that are not those of the description
};

/// A file in another format.
struct RecodedFile {
  std::string bytes;
  const char* extension;  ///< ".png"
};

struct SceneWriting {
  std::string comment;  ///< stands at the beginning of the file
  /// Folder, relative to the new file's, of what stood in the scene's own file; names in it are hashes of the content.
  std::string folder;
  /// What the new file calls a file that the scene names; `where` is the object that names it.
  std::function<std::string(const std::string& name, const SourceLocation& where)> file_name;
  /// The format that an image which stood in the scene's file gets; nullopt: its own.
  std::function<std::optional<RecodedFile>(std::string_view bytes)> recode;
};

/// The scene in the format of version 3.0.0. Numbers have as many digits as are needed to read the same numbers again.
/// What several objects refer to gets an id and stands before them; emitters are written again for each of their
/// shapes, as a shape of Mitsuba's has one of its own. Objects that could not be read are left out: the scene must have
/// no errors.
SceneDocument scene_document(const ObjectDescription& scene, const SceneWriting& writing);

}  // namespace covary
