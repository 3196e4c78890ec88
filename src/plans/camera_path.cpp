// SPDX-License-Identifier: Apache-2.0
#include "plans/camera_path.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>
#include <initializer_list>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string_view>

#include "core/content_hash.h"
#include "core/error.h"
#include "core/json_depth.h"

namespace covary {
namespace {

using Json = nlohmann::ordered_json;

/// Throws for members not in `names`.
void check_members(const Json& object, std::initializer_list<std::string_view> names) {
  for (const auto& [name, value] : object.items())
    if (std::find(names.begin(), names.end(), name) == names.end())
      throw Error(ErrorCode::kInput, fmt::format("unknown member '{}'; expected '{}'", name, fmt::join(names, "', '")));
}

double number(const Json& value, const std::string& what) {
  if (!value.is_number()) throw Error(ErrorCode::kInput, fmt::format("{} is not a number", what));
  return value.get<double>();
}

Matrix4 matrix(const Json& value) {
  const char* const expected = "'to_world' is not a matrix: expected 4 rows of 4 numbers, or 16 numbers by rows";
  const auto refuse_unless = [&](bool is_right) {
    if (!is_right) throw Error(ErrorCode::kInput, expected);
  };
  refuse_unless(value.is_array() && (value.size() == 4 || value.size() == 16));
  Matrix4 m;
  for (size_t i = 0; i < 4; ++i)
    for (size_t j = 0; j < 4; ++j) {
      if (value.size() == 4) refuse_unless(value[i].is_array() && value[i].size() == 4);
      const Json& entry = value.size() == 4 ? value[i][j] : value[4 * i + j];
      refuse_unless(entry.is_number());
      m[i][j] = entry.get<double>();
    }
  return m;
}

TransformKey keyframe(const Json& value, size_t index) {
  try {
    if (!value.is_object()) throw Error(ErrorCode::kInput, "expected an object");
    check_members(value, {"time", "to_world"});
    for (const char* name : {"time", "to_world"})
      if (!value.contains(name)) throw Error(ErrorCode::kInput, fmt::format("'{}' is missing", name));
    return {number(value["time"], "'time'"), matrix(value["to_world"])};
  } catch (const Error& error) {
    throw Error(ErrorCode::kInput, fmt::format("keyframe {}: {}", index, error.what()));
  }
}

CameraPath parse(const std::string& text) {
  if (line_nested_too_deep(text))
    throw Error(ErrorCode::kInput, fmt::format("arrays and objects nest deeper than {}", kMaxJsonDepth));
  Json json;
  try {
    json = Json::parse(text);
  } catch (const Json::parse_error& error) {
    const std::string_view what = error.what();
    throw Error(ErrorCode::kInput, fmt::format("is no JSON: {}", what.substr(what.find("] ") + 2)));
  }
  if (!json.is_object()) throw Error(ErrorCode::kInput, "expected a JSON object");
  check_members(json, {"frames_per_second", "keyframes"});
  const double rate = json.contains("frames_per_second") ? number(json["frames_per_second"], "'frames_per_second'") : 1;
  if (!(rate > 0) || !std::isfinite(rate)) throw Error(ErrorCode::kInput, "'frames_per_second' is not above 0");
  if (!json.contains("keyframes") || !json["keyframes"].is_array())
    throw Error(ErrorCode::kInput, "the array 'keyframes' is missing");
  std::vector<TransformKey> keys;
  for (const Json& key : json["keyframes"]) keys.push_back(keyframe(key, keys.size()));
  return {KeyedTransform(std::move(keys)), rate};
}

}  // namespace

CameraPath parse_camera_path(const std::string& text, const std::string& name) {
  try {
    return parse(text);
  } catch (const Error& error) {
    throw Error(ErrorCode::kInput, fmt::format("camera path '{}': {}", name, error.what()));
  }
}

CameraPath read_camera_path(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  if (!file)
    throw Error(ErrorCode::kIo, fmt::format("cannot read the camera path '{}': {}", path, std::strerror(errno)));
  return parse_camera_path(text, path);
}

void place_camera(LoadedScene& scene, const Transform& to_world) {
  CameraSettings settings = scene.camera->settings();
  settings.to_world = to_world;
  *scene.camera = Camera(settings, scene.width, scene.height);
  std::string text = scene.files_hash;
  if (scene.scene->moves()) text += fmt::format(" time {}", scene.scene->time());
  for (const auto& row : to_world.matrix())
    for (const double entry : row) text += fmt::format(" {}", entry);
  scene.content_hash = hash_text(hash_bytes(text));
}

}  // namespace covary
