// SPDX-License-Identifier: Apache-2.0
// Writes ObjectDescription trees of any scene file as Mitsuba XML, which xml_reader.h reads into the same trees.
#pragma once

#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "scene/parameters.h"

namespace covary {

/// A file that the scene needs besides its own: a mesh, an image.
struct SceneDocumentFile {
  std::string path;        ///< as the scene's file names it, relative to its folder
  std::string_view bytes;  ///< lives as long as the description
};

struct SceneDocument {
  std::string xml;
  std::vector<SceneDocumentFile> files;
  std::deque<std::string> recoded;  ///< bytes of files that differ from those of the description
};

/// A file in another format.
struct RecodedFile {
  std::string bytes;
  const char* extension;  ///< ".png"
};

struct SceneWriting {
  std::string comment;  ///< stands at the beginning of the file
  /// Folder, relative to the new file's, for data from inside the scene's own file; file names in it are hashes of the
  /// content.
  std::string folder;
  /// The new file's name for a file of the scene; `where` is the object that names it.
  std::function<std::string(const std::string& name, const SourceLocation& where)> file_name;
  /// The format for an image from inside the scene's file; nullopt: its own.
  std::function<std::optional<RecodedFile>(std::string_view bytes)> recode;
};

/// The scene in the format of version 3.0.0. Numbers have enough digits to be read back exactly. Objects that several
/// others refer to get an id and come before these; emitters are repeated for each of their shapes, because a Mitsuba
/// shape has its own emitter. Unreadable objects are left out: the scene must have no errors.
SceneDocument scene_document(const ObjectDescription& scene, const SceneWriting& writing);

}  // namespace covary
