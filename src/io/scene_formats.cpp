// SPDX-License-Identifier: Apache-2.0
#include "io/scene_formats.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "formats/xml_document.h"
#include "gltf/gltf_reader.h"
#include "pbrt/pbrt_reader.h"

namespace covary {
namespace {

SceneXml read_xml(const SceneText& t, FileResolver& files, Diagnostics& diagnostics) {
  return read_scene_xml(t.text, t.name, t.defines, files, diagnostics);
}
SceneXml read_pbrt(const SceneText& t, FileResolver& files, Diagnostics& diagnostics) {
  return read_scene_pbrt(t.text, t.name, files, diagnostics);
}
SceneXml read_gltf(const SceneText& t, FileResolver& files, Diagnostics& diagnostics) {
  return read_scene_gltf(t.text, t.name, files, diagnostics, t.time);
}

const SceneFormat* find_format(std::string_view name) {
  const auto has_ending = [&](std::string_view ending) { return name.ends_with(ending); };
  const auto formats = scene_formats();
  const auto found =
      std::ranges::find_if(formats, [&](const SceneFormat& f) { return std::ranges::any_of(f.endings, has_ending); });
  return found == formats.end() ? nullptr : &*found;
}

}  // namespace

std::span<const SceneFormat> scene_formats() {
  static const std::vector<SceneFormat> formats = {
      {.name = "Mitsuba XML", .endings = {".xml"}, .read = read_xml, .has_defines = true},
      {.name = "pbrt", .endings = {".pbrt"}, .read = read_pbrt},
      {.name = "glTF", .endings = {".glb", ".gltf"}, .read = read_gltf, .holds_models = true, .moves_in_seconds = true},
  };
  return formats;
}

const SceneFormat& scene_format_of(std::string_view name) {
  const SceneFormat* found = find_format(name);
  return found ? *found : scene_formats()[0];
}

bool is_scene_file(std::string_view name) { return find_format(name) != nullptr; }

std::string scene_format_names(const std::string& last_separator) {
  std::string text;
  const auto formats = scene_formats();
  for (size_t i = 0; i < formats.size(); ++i)
    text += (i == 0 ? "" : i + 1 < formats.size() ? ", " : last_separator) + formats[i].name;
  return text;
}

std::string scene_file_endings() {
  std::vector<std::string_view> endings;
  for (const SceneFormat& format : scene_formats())
    endings.insert(endings.end(), format.endings.begin(), format.endings.end());
  return fmt::format("{}", fmt::join(endings, ", "));
}

namespace {

/// Of a file that is no scene of covary by its name, and no XML by its text.
void refuse_other_format(const SceneText& text) {
  const size_t start = text.text.find_first_not_of("\xef\xbb\xbf \t\r\n");
  if (is_scene_file(text.name) || (start != std::string_view::npos && text.text[start] == '<')) return;
  if (!kind_of_file(text.text).empty()) return;  // what it is is told instead
  throw Error(
      ErrorCode::kInput,
      fmt::format("{}: not a scene that covary reads, which are {} ({}); export it as one of them, e.g. as .glb",
                  text.name, scene_format_names(), scene_file_endings()));
}

}  // namespace

SceneXml read_scene_file(const SceneText& text, FileResolver& files, Diagnostics& diagnostics) {
  refuse_other_format(text);
  const SceneFormat& format = scene_format_of(text.name);
  if (!format.has_defines && !text.defines.empty())
    throw Error(ErrorCode::kUsage,
                fmt::format("{}: scenes of {} have no parameters to define", text.name, format.name));
  SceneXml result = format.read(text, files, diagnostics);
  if (result.scene) return result;
  diagnostics.throw_if_errors();
  throw Error(ErrorCode::kInput, text.name + ": the file holds no scene");
}

}  // namespace covary
