// SPDX-License-Identifier: Apache-2.0
// Scenes of any format that is read, in Mitsuba's.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "formats/scene_writer.h"
#include "io/load_scene.h"

namespace covary {

struct ConvertedScene {
  SceneDocument document;
  std::vector<std::string> files;  ///< paths of all that the scene reads, its own file included
  std::vector<std::string> warnings;
  std::shared_ptr<const ObjectDescription> description;  ///< holds the bytes of the document's files
};

/// The scene `path` as Mitsuba's XML of the name `output`: files that it names are found from that file's folder, and
/// what stood in its own file goes to a folder beside it, "NAME-files". The scene is loaded first, so that nothing is
/// converted that could not be rendered: throws as load_scene().
ConvertedScene convert_scene(const std::string& path, const std::string& output, const LoadOptions& options = {});

}  // namespace covary
