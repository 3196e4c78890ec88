// SPDX-License-Identifier: Apache-2.0
// The formats of scene files. scene_formats() has a row for each, from which follow what `render` reads and what help
// and messages say; a reader makes object descriptions of a file's text (formats/xml_reader.h).
#pragma once

#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "formats/xml_reader.h"

namespace covary {

struct SceneText {
  std::string_view text;
  const std::string& name;  ///< of the file
  const std::map<std::string, std::string>& defines;
  std::optional<double> time;  ///< of the file's animations, in seconds; nullopt: at rest
};

struct SceneFormat {
  const char* name;
  std::vector<std::string_view> endings;  ///< of its files' names
  SceneXml (*read)(const SceneText& text, FileResolver& files, Diagnostics& diagnostics);
  bool has_defines = false;  ///< parameters that --define sets
  /// Its files are models with y upwards, which often have no camera, and hardly a light: they are framed and lit.
  bool holds_models = false;
  bool moves_in_seconds = false;  ///< files have animations, which are read at SceneText::time
};

std::span<const SceneFormat> scene_formats();

/// The format of a file of this name; the first one if its ending is unknown.
const SceneFormat& scene_format_of(std::string_view name);
/// Whether a file of this name is a scene, rather than an image or something else.
bool is_scene_file(std::string_view name);
/// For help: "Mitsuba XML, pbrt or glTF", with the last `separator` between the last two, and ".xml, .pbrt, …".
std::string scene_format_names(const std::string& last_separator = " or ");
std::string scene_file_endings();

/// Reads the text of a scene file in the format given by its name. Throws Error(kInput) with all problems if no scene
/// results, and Error(kUsage) for defines that the format cannot use.
SceneXml read_scene_file(const SceneText& text, FileResolver& files, Diagnostics& diagnostics);

}  // namespace covary
