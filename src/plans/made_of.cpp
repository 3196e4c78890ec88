// SPDX-License-Identifier: Apache-2.0
#include "plans/made_of.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>
#include <sstream>

#include "core/error.h"
#include "core/number_text.h"
#include "film/film.h"
#include "film/film_file.h"
#include "film/image_file.h"

namespace covary {
namespace {

constexpr const char* kOfTheFile[] = {"output",     "passes",   "resume",        "overwrite",
                                      "checkpoint", "exposure", "save-training", "no-preview"};
constexpr const char* kGoals[] = {"spp", "time", "until", "max-spp"};
constexpr const char* kScene = "scene";
/// Options that change nothing but the scene, whose hash tells whether they do: "auto" may mean what is named.
constexpr const char* kOfSceneAlone[] = {"background", "camera", "environment"};
/// Options and places that explain another hash of the scene.
constexpr const char* kOfScene[] = {"background",     "camera",     "define",     "environment",
                                    "ignore-unknown", "resolution", kMadeAtPlace, kMadeAtTime};

template <size_t N>
bool is_among(const char* const (&names)[N], const std::string& name) {
  return std::find(std::begin(names), std::end(names), name) != std::end(names);
}

/// Whether the values say nothing to people.
bool is_hash(const std::string& name) { return name == kMadeAtPlace || name == kMadeAfter; }

std::map<std::string, std::string> lines_of(const std::string& text) {
  std::map<std::string, std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) {
    const size_t at = line.find('=');
    lines[line.substr(0, at)] = at == std::string::npos ? "" : line.substr(at + 1);
  }
  return lines;
}

}  // namespace

std::string made_of(const std::string& scene_hash, const std::vector<OptionValues>& options) {
  std::map<std::string, std::string> lines;
  for (const OptionValues& some : options)
    for (const auto& [name, value] : some)
      if (!is_among(kOfTheFile, name)) lines[name] = value;
  std::string text = fmt::format("{}={}", kScene, scene_hash);
  for (const auto& [name, value] : lines) {
    std::string one = value;
    std::replace(one.begin(), one.end(), '\n', ' ');
    text += fmt::format("\n{}={}", name, one);
  }
  return text;
}

std::string differences(const std::string& earlier, const std::string& now, bool continues) {
  const std::map<std::string, std::string> before = lines_of(earlier), after = lines_of(now);
  std::set<std::string> names;
  for (const auto* lines : {&before, &after})
    for (const auto& [name, value] : *lines) names.insert(name);
  std::string text;
  bool scene_explained = false;
  const auto value_in = [](const std::map<std::string, std::string>& lines, const std::string& name) {
    const auto found = lines.find(name);
    return found == lines.end() ? "default" : found->second.empty() ? "on" : found->second;
  };
  const bool is_same_scene = value_in(before, kScene) == value_in(after, kScene);
  for (const std::string& name : names) {
    const std::string old_value = value_in(before, name), new_value = value_in(after, name);
    if (old_value == new_value || name == kScene || (continues && is_among(kGoals, name))) continue;
    if (is_same_scene && is_among(kOfSceneAlone, name)) continue;
    if (name == kMadeAfter && (!before.contains(name) || !after.contains(name))) continue;  // told as the history
    scene_explained = scene_explained || is_among(kOfScene, name);
    text += text.empty() ? "" : "; ";
    text += is_hash(name) ? fmt::format("another {}", name) : fmt::format("{} {}, now {}", name, old_value, new_value);
  }
  if (!scene_explained && !is_same_scene)
    text += fmt::format("{}another scene, or a changed one", text.empty() ? "" : "; ");
  return text;
}

MadeFile made_file(const std::string& path) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(path, ignored)) return {};
  std::map<std::string, std::string> attributes;
  try {
    attributes = inspect_image(path, ChecksumPolicy::kIgnore).attributes;
  } catch (const Error&) {
    return {};  // not an image
  }
  const auto value = [&](const char* key) {
    const auto found = attributes.find(std::string("covary:") + key);
    return found == attributes.end() ? std::string() : found->second;
  };
  return {value(film_key::kMadeOf), value(film_key::kComplete) != "false", parse_real(value(film_key::kPredicted)),
          parse_real(value("samples")).value_or(0)};
}

bool reaches(const MadeFile& file, const std::string& made_of, double until) {
  return file.complete && !file.made_of.empty() && file.predicted && *file.predicted <= until &&
         differences(file.made_of, made_of, true).empty();
}

void check_made_alike(const std::string& path, const std::string& made_of, bool continues, bool resumes) {
  const MadeFile file = made_file(path);
  if (file.made_of.empty()) return;
  if (const std::string differ = differences(file.made_of, made_of, continues); !differ.empty())
    throw Error(ErrorCode::kInput,
                fmt::format("{}'{}' was rendered with other settings ({}){}; give another name, or "
                            "`overwrite` to replace it",
                            resumes ? "`resume`: " : "", path, differ,
                            resumes && !continues ? ", and its samples were not kept (`passes`)" : ""));
}

}  // namespace covary
