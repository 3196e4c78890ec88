// SPDX-License-Identifier: Apache-2.0
#include "lab/suite.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <set>

#include "core/error.h"
#include "lab/json_values.h"
#include "sequences/frame_names.h"

namespace covary::lab {
namespace {

using Json = nlohmann::ordered_json;
namespace fs = std::filesystem;

/// Options of `covary render` that the laboratory sets itself.
const std::vector<std::string> kReserved = {"--spp",  "--time",       "--seed",   "-o",       "--output",
                                            "--json", "--passes",     "--resume", "--quiet",  "--no-preview",
                                            "--crop", "--resolution", "--replay", "--frames", "--camera-path"};

void check_options(const std::string& where, const std::vector<std::string>& options,
                   std::vector<std::string>& problems) {
  for (const std::string& word : options) {
    const std::string option = word.substr(0, word.find('='));
    if (std::find(kReserved.begin(), kReserved.end(), option) != kReserved.end())
      problems.push_back(fmt::format("{}: '{}' is chosen by the suite's scenes, budgets and seeds", where, option));
  }
}

template <typename Entry>
void check_names(const char* what, const std::vector<Entry>& entries, std::vector<std::string>& problems) {
  if (entries.empty()) problems.push_back(fmt::format("there are no {}s", what));
  std::set<std::string> names;
  for (const Entry& entry : entries)
    if (!names.insert(entry.name).second)
      problems.push_back(fmt::format("two {}s have the name '{}'", what, entry.name));
}

void check_published(const Suite& suite, std::vector<std::string>& problems) {
  std::vector<std::string> methods;
  for (const MethodEntry& m : suite.methods) methods.push_back(m.name);
  std::set<std::string> reported;
  for (const auto* table : {&suite.published_relmse, &suite.published_ratio})
    for (const auto& [scene, of_scene] : *table)
      for (const auto& [method, values] : of_scene)
        if (!suite.method(method) && reported.insert(method).second)
          problems.push_back(
              fmt::format("published: no method is named '{}'{}", method, did_you_mean(method, methods)));
}

Json json_of(const ReferencePlan& plan) {
  if (plan.files.empty()) return {{"spp", plan.spp}};
  return {{"files", plan.files}};
}

Json json_of(const SceneEntry& scene) {
  Json json{{"name", scene.name}, {"file", scene.file}};
  if (!scene.resolution.empty()) json["resolution"] = scene.resolution;
  if (!scene.crop.empty()) json["crop"] = scene.crop;
  if (scene.max_depth) json["max_depth"] = *scene.max_depth;
  if (!scene.defines.empty()) json["defines"] = scene.defines;
  if (!scene.credit.empty()) json["credit"] = scene.credit;
  if (!scene.frames.empty()) json["frames"] = scene.frames;
  if (!scene.camera_path.empty()) json["camera_path"] = scene.camera_path;
  if (!scene.layer.empty()) json["layer"] = scene.layer;
  for (const CropWindow& w : scene.insets)
    json["insets"].push_back({{"x", w.x}, {"y", w.y}, {"w", w.width}, {"h", w.height}});
  if (scene.reference) json["reference"] = json_of(*scene.reference);
  return json;
}

Json json_of(const MethodEntry& method) {
  Json json{{"name", method.name}, {"options", method.options}};
  if (!method.program.empty()) json["program"] = method.program;
  if (!method.renders) json["renders"] = false;
  if (!method.then.empty()) json["then"] = method.then;
  if (method.unbiased) json["unbiased"] = true;
  if (method.optional) json["optional"] = true;
  return json;
}

}  // namespace

std::string Budget::label() const { return spp ? fmt::format("{} spp", spp) : fmt::format("{:g} s", seconds); }
std::string Budget::key() const { return spp ? fmt::format("{}", spp) : fmt::format("{:g}s", seconds); }

const MethodEntry* Suite::method(const std::string& method_name) const {
  for (const MethodEntry& m : methods)
    if (m.name == method_name) return &m;
  return nullptr;
}

std::vector<std::string> validate(const Suite& suite) {
  std::vector<std::string> problems;
  check_names("scene", suite.scenes, problems);
  check_names("method", suite.methods, problems);
  if (suite.budgets.empty()) problems.push_back("there are no budgets");
  if (suite.seeds.empty()) problems.push_back("there are no seeds");
  std::set<uint64_t> seeds;
  for (uint64_t seed : suite.seeds) {
    if (!seeds.insert(seed).second) problems.push_back(fmt::format("the seed {} appears twice", seed));
    for (uint64_t reserved : kReferenceSeeds)
      if (seed == reserved)
        problems.push_back(
            fmt::format("the seed {} is reserved for references, which must not share samples with a run", seed));
  }
  const bool of_frames = std::any_of(suite.scenes.begin(), suite.scenes.end(),
                                     [](const SceneEntry& scene) { return !scene.frames.empty(); });
  for (const MethodEntry& method : suite.methods) {
    check_options("method '" + method.name + "'", method.options, problems);
    if (!method.renders && method.program.empty())
      problems.push_back("method '" + method.name + "': 'renders' is false, so it needs a 'program'");
    if (!method.renders && !method.options.empty())
      problems.push_back("method '" + method.name + "': 'options' have no effect, as covary does not render for it");
    if (of_frames && !method.program.empty())
      problems.push_back("method '" + method.name + "': a program makes single images, not frames");
  }
  check_options("common_options", suite.common_options, problems);
  for (const std::string& word : suite.common_options)
    if (word.substr(0, word.find('=')) == "--estimator")
      problems.emplace_back("common_options: '--estimator' belongs to methods; references are plain means");
  std::vector<std::string> methods;
  for (const MethodEntry& m : suite.methods) methods.push_back(m.name);
  if (!suite.methods.empty() && !suite.method(suite.baseline))
    problems.push_back(
        fmt::format("baseline: no method is named '{}'{}", suite.baseline, did_you_mean(suite.baseline, methods)));
  for (const SceneEntry& scene : suite.scenes) {
    FrameRange frames;
    if (!scene.frames.empty() && !read_frame_range(scene.frames, frames))
      problems.push_back(fmt::format("scene '{}': frames '{}': expected FIRST-LAST[:STEP] or one number, e.g. 1-16",
                                     scene.name, scene.frames));
    if (scene.frames.empty() && !scene.camera_path.empty())
      problems.push_back(fmt::format("scene '{}': 'camera_path' has no effect without 'frames'", scene.name));
    const ReferencePlan& plan = suite.reference_of(scene);
    if (plan.spp == 0 && plan.files.empty())
      problems.push_back(fmt::format(
          "scene '{}' has no reference: give \"reference\": {{\"spp\": N}} or {{\"files\": [A, B]}}", scene.name));
  }
  if (suite.show && std::find(suite.budgets.begin(), suite.budgets.end(), *suite.show) == suite.budgets.end())
    problems.push_back(fmt::format("show: {} is not one of the budgets", suite.show->label()));
  check_published(suite, problems);
  return problems;
}

void throw_if_invalid(const Suite& suite) {
  const std::vector<std::string> problems = validate(suite);
  if (!problems.empty()) throw Error(ErrorCode::kUsage, fmt::format("{}", fmt::join(problems, "\n")));
}

Json to_json(const Suite& suite) {
  Json json{{"name", suite.name}, {"title", suite.title}};
  if (!suite.description.empty()) json["description"] = suite.description;
  if (!suite.scene_root.empty()) json["scene_root"] = suite.scene_root;
  json["scenes"] = Json::array();
  for (const SceneEntry& scene : suite.scenes) json["scenes"].push_back(json_of(scene));
  for (const MethodEntry& method : suite.methods) json["methods"].push_back(json_of(method));
  for (const Budget& budget : suite.budgets) json["budgets"].push_back(json_of(budget));
  json["seeds"] = suite.seeds;
  json["common_options"] = suite.common_options;
  json["baseline"] = suite.baseline;
  if (suite.show) json["show"] = json_of(*suite.show);
  if (suite.reference.spp || !suite.reference.files.empty()) json["reference"] = json_of(suite.reference);
  if (!suite.published_source.empty()) {
    json["published"]["source"] = suite.published_source;
    if (!suite.published_relmse.empty()) json["published"]["relmse"] = suite.published_relmse;
    if (!suite.published_ratio.empty()) json["published"]["ratio"] = suite.published_ratio;
  }
  return json;
}

namespace {

/// The first of the current folder, the source tree and the installation that has `file`, with `root`; or "".
std::string folder_with(const std::string& root, const std::string& file, const std::string& program) {
  const fs::path beside = fs::path(program).parent_path();
  for (const fs::path& base : {fs::current_path(), beside / ".." / "..", beside / ".." / "share" / "covary"})
    if (fs::exists(base / root / file)) return (base / root).lexically_normal().string();
  return "";
}

}  // namespace

std::string scenes_folder(const Suite& suite, const std::string& word, const std::string& program) {
  const fs::path given(word);
  if (given.extension() == ".json") return (fs::absolute(given).parent_path() / suite.scene_root).string();
  if (given.extension() == ".xml" || suite.scenes.empty() || fs::path(suite.scenes[0].file).is_absolute())
    return fs::current_path().string();
  if (!suite.scene_root.empty())
    if (std::string folder = folder_with(suite.scene_root, suite.scenes[0].file, program); !folder.empty())
      return folder;
  throw Error(ErrorCode::kUsage, fmt::format("the suite '{0}' needs --scenes DIR, the folder that holds {1} (`covary "
                                             "scenes {0}` says where its scenes come from)",
                                             suite.name, suite.scenes[0].file));
}

std::string own_scenes_folder(const std::string& program) {
  if (std::string folder = folder_with("scenes", "room.xml", program); !folder.empty()) return folder;
  throw Error(ErrorCode::kUsage,
              "the scenes of covary are not found; run the command where the folder 'scenes' of its "
              "source tree is");
}

}  // namespace covary::lab
