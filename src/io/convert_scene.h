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
  std::vector<std::string> files;  ///< paths of all files that the scene reads, its own included
  std::vector<std::string> warnings;
  std::shared_ptr<const ObjectDescription> description;  ///< owns the bytes of the document's files
};

/// Converts the scene `path` to Mitsuba XML to be saved as `output`: referenced files are relative to its folder, and
/// data embedded in the scene's own file goes to a folder next to it, "NAME-files". Loads the scene first, so that only
/// renderable scenes are converted; throws like load_scene().
ConvertedScene convert_scene(const std::string& path, const std::string& output, const LoadOptions& options = {});

}  // namespace covary
