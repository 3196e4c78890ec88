// SPDX-License-Identifier: Apache-2.0
// covary scenes: the scenes of the built-in suites, where they come from, and which of them a folder has.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <memory>
#include <set>
#include <vector>

#include "commands.h"
#include "core/error.h"
#include "core/known_names.h"
#include "declared_options.h"
#include "io/load_scene.h"
#include "lab/suite.h"
#include "papers/paper.h"
#include "plans/integrator_choice.h"
#include "value_names.h"

namespace covary {
namespace {

namespace fs = std::filesystem;

struct ScenesOptions {
  std::vector<std::string> suites;
  std::string folder;
};

struct KnownScene {
  std::string credit;
  bool is_own = false;  ///< comes with covary; those of others are in folders of their own
  std::set<std::string> suites, papers;
};

/// Content hashes (`covary info`) of the scenes that the tables in docs/ were measured with.
const std::map<std::string, std::string>& measured_hashes() {
  static const std::map<std::string, std::string> hashes = {
      {"kitchen/scene_v3.xml", "f3c3bb2cb04b52da"},        {"bathroom2/scene_v3.xml", "3a4b540b2342e33a"},
      {"dining-room/scene_v3.xml", "a719996817616c36"},    {"classroom/scene_v3.xml", "d1436e65183f1d6e"},
      {"glass-of-water/scene_v3.xml", "fd6e4a5a96d6e3b2"}, {"living-room/scene_v3.xml", "419a6bac5a3370df"},
      {"house/scene_v3.xml", "67da0744014772a5"},          {"staircase/scene_v3.xml", "3a43a5e74c3901eb"},
      {"teapot/scene_v3.xml", "b4f8822944d45f36"},         {"veach-ajar/scene_v3.xml", "177bf10d0439e669"},
      {"veach-bidir/scene_v3.xml", "20956626fb665cca"},    {"cornell-box/scene_v3.xml", "ea052fc166a92ec8"},
      {"cms-diningroom2/scene.xml", "59306276f09ba262"},   {"cms-rgbsofa/scene.xml", "2e972d116f5c74ed"},
      {"cms-bathroom/scene.xml", "bbfb1f0fe52a0998"},      {"cms-veachmis/scene.xml", "30e28fe58c1da230"},
      {"cms-modernhall/scene.xml", "6e24f1e0ce8462dd"}};
  return hashes;
}

/// Whether the file is what a person calls `name`: kitchen/scene_v3.xml is "kitchen", room.xml "room".
bool is_called(const std::string& file, const std::string& name) {
  return file == name || file.starts_with(name + "/") || file.substr(0, file.rfind('.')) == name;
}

/// By file. Throws Error(kUsage) for a name that no built-in suite, paper or scene of one has.
std::map<std::string, KnownScene> known_scenes(const std::vector<std::string>& only) {
  std::map<std::string, KnownScene> scenes;
  std::vector<std::string> suites, names;
  for (const auto& [name, text] : lab::builtin_suites()) {
    suites.push_back(name);
    const lab::Suite suite = lab::parse_suite(std::string(lab::builtin_suites().at(name)), name);
    for (const lab::SceneEntry& entry : suite.scenes) {
      KnownScene& scene = scenes[entry.file];
      scene.credit = entry.credit, scene.is_own = entry.file.find('/') == std::string::npos;
      scene.suites.insert(name);
    }
  }
  for (const auto& [paper, text] : lab::builtin_papers()) {
    const lab::Paper read = lab::parse_paper(std::string(text), paper);
    for (auto& [file, scene] : scenes)
      if (std::ranges::any_of(read.parts,
                              [&](const lab::PaperPart& part) { return scene.suites.contains(part.suite); }))
        scene.papers.insert(paper);
    suites.push_back(paper);
  }
  names = suites;
  for (const auto& [file, scene] : scenes) names.push_back(file.substr(0, file.find_first_of("./")));
  const auto is_asked = [](const std::string& name, const auto& scene) {
    return scene.second.suites.contains(name) || scene.second.papers.contains(name) || is_called(scene.first, name);
  };
  for (const std::string& name : only)
    if (std::ranges::none_of(scenes, [&](const auto& scene) { return is_asked(name, scene); }))
      throw Error(ErrorCode::kUsage,
                  fmt::format("no suite or scene is named '{}'", name) +
                      hint_and_list(name, names, fmt::format("expected a scene, or {}", fmt::join(suites, ", "))));
  if (!only.empty())
    std::erase_if(scenes, [&](const auto& scene) {
      return std::ranges::none_of(only, [&](const std::string& name) { return is_asked(name, scene); });
    });
  return scenes;
}

/// What the folder has of a scene: "", or what is wrong with it.
std::string problem_of(const fs::path& file, const std::string& name) {
  if (!fs::exists(file)) return "missing";
  try {
    LoadOptions options;
    options.make_integrator = integrator_maker({});
    const auto measured = measured_hashes().find(name);
    const std::string hash = load_scene(file.string(), options).content_hash;
    return measured == measured_hashes().end() || measured->second == hash ? "" : "another version";
  } catch (const Error& error) {
    return error.what();
  }
}

void list(const std::map<std::string, KnownScene>& scenes) {
  for (const auto& [file, scene] : scenes)
    fmt::print("{}\n    {}\n    in {}{}\n", file, scene.credit, fmt::join(scene.suites, ", "),
               scene.is_own ? "; comes with covary" : "");
  const auto any = [&](const auto& is) { return std::ranges::any_of(scenes, is); };
  if (any([](const auto& s) { return s.second.credit.find("Rendering resources") != std::string::npos; }))
    fmt::print(
        "Rendering resources: https://benedikt-bitterli.me/resources/; `covary convert-scene scene.xml "
        "scene_v3.xml` updates those that are older\n");
  if (any([](const auto& s) { return s.first.starts_with("cms-"); }))
    fmt::print(
        "Controlled mixture sampling: https://github.com/qingqhua/ControlledMixtureSampling, in the format of "
        "SeeSharp\n");
}

/// Throws Error(kInput) if scenes are missing or cannot be read.
void check(const std::map<std::string, KnownScene>& scenes, const std::string& folder) {
  if (!fs::is_directory(folder)) throw Error(ErrorCode::kIo, "--folder '" + folder + "': there is no such folder");
  size_t bad = 0, all = 0;
  for (const auto& [file, scene] : scenes) {
    if (scene.is_own) continue;
    const std::string problem = problem_of(fs::path(folder) / file, file);
    fmt::print("{:32} {}\n", file, problem.empty() ? "ok" : problem);
    bad += !problem.empty() && problem != "another version", ++all;
  }
  std::fflush(stdout);
  if (bad > 0)
    throw Error(ErrorCode::kInput, fmt::format("{} of {} scenes are missing or cannot be read in '{}'; `covary scenes` "
                                               "says where they come from",
                                               bad, all, folder));
}

void run(const ScenesOptions& o) {
  const std::map<std::string, KnownScene> scenes = known_scenes(o.suites);
  o.folder.empty() ? list(scenes) : check(scenes, o.folder);
}

}  // namespace

void add_scenes(CLI::App& app) {
  const auto o = std::make_shared<ScenesOptions>();
  CLI::App* command =
      app.add_subcommand("scenes", "List the scenes of the built-in suites, and check a folder of them");
  add_value(*command, "SUITE", o->suites, "NAME",
            "Only those of these suites or papers, or these scenes; default: all");
  add_value(*command, "--folder", o->folder, kFolderValue,
            "Say which of them this folder has, and whether they are those that the tables were measured with");
  command->callback([o] { run(*o); });
}

}  // namespace covary
