// SPDX-License-Identifier: Apache-2.0
// Converts scenes of any supported format to Mitsuba's.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "formats/scene_writer.h"
#include "io/load_scene.h"

namespace covary {

struct ConvertedScene {
  SceneDocument document;
  std::vector<std::string> files;  ///< paths of all files that the scene reads, including its own
  std::vector<std::string> warnings;
  std::shared_ptr<const ObjectDescription> description;  ///< holds the bytes of the document's files
};

/// The scene `path` as Mitsuba XML with the name `output`: files that it names are relative to that file's folder, and
/// data from inside its own file goes to a folder beside it, "NAME-files". The scene is loaded first, so that only
/// scenes that can be rendered are converted: throws like load_scene().
ConvertedScene convert_scene(const std::string& path, const std::string& output, const LoadOptions& options = {});

}  // namespace covary
