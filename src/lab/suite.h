// SPDX-License-Identifier: Apache-2.0
// An experiment as data: scenes x methods x budgets x seeds. File format: docs/experiments.md.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "film/film.h"

namespace covary::lab {

/// Samples per pixel or seconds: exactly one is set.
struct Budget {
  uint32_t spp = 0;
  double seconds = 0;
  bool operator==(const Budget&) const = default;
  std::string label() const;  ///< "192 spp", "10 s"
  std::string key() const;    ///< as in `published`: "192", "10s"
};

/// References rendered with `spp` samples per pixel in each half, or read from one or two files.
struct ReferencePlan {
  uint32_t spp = 0;
  std::vector<std::string> files;
};

struct SceneEntry {
  std::string name;
  std::string file;        ///< as written; relative to the suite's scene folder
  std::string resolution;  ///< WIDTHxHEIGHT, or empty: the scene's own
  std::string crop;        ///< X,Y,WIDTH,HEIGHT; WIDTHxHEIGHT for the centre of the frame; or empty
  std::optional<int64_t> max_depth;
  std::vector<std::string> defines;  ///< name=value
  std::string credit;                ///< author, title, licence
  std::string frames;                ///< "1-16": frames of a sequence; empty: one image
  std::string camera_path;           ///< for the frames: file next to the scene's; empty: the scene's own camera
  std::string layer;                 ///< layer of images and references to measure; empty: R G B
  std::vector<CropWindow> insets;    ///< in the frame
  std::optional<ReferencePlan> reference;
};

struct MethodEntry {
  std::string name;
  std::vector<std::string> options;            ///< of `covary render`
  std::vector<std::vector<std::string>> then;  ///< further commands "covary WORD… IN -o OUT"
  bool unbiased = false;                       ///< a squared bias then suggests a wrong reference
  bool optional = false;                       ///< skipped, with a warning, on scenes and machines that lack support
  /// Name of a program of the user's that makes the image of what was rendered (Programs in plan.h); or empty.
  std::string program = "";
  /// Whether covary renders for it. Otherwise the program makes the image of the scene itself, or has it.
  bool renders = true;
};

struct Suite {
  std::string name, title, description;
  std::string scene_root;  ///< folder of the scene files
  std::vector<SceneEntry> scenes;
  std::vector<MethodEntry> methods;
  std::vector<Budget> budgets;
  std::vector<uint64_t> seeds;
  std::vector<std::string> common_options;  ///< for every render, references included
  std::string baseline;                     ///< name of a method
  std::optional<Budget> show;               ///< budget of the pictures; default: the last
  ReferencePlan reference;
  std::string published_source;
  /// [scene][method][budget key] -> relMSE, and -> error of the baseline / error of the method.
  std::map<std::string, std::map<std::string, std::map<std::string, double>>> published_relmse, published_ratio;

  const MethodEntry* method(const std::string& method_name) const;
  const ReferencePlan& reference_of(const SceneEntry& scene) const {
    return scene.reference ? *scene.reference : reference;
  }
};

/// Seeds of the two halves of a reference; no run may use them.
inline constexpr uint64_t kReferenceSeeds[2] = {900000001, 900000002};

/// A problem with a word of a command.
struct WordProblem {
  size_t word;
  std::string text;
};
/// Finds forbidden words in a command: "render" with the options of a method, or one of the commands that follow.
using CommandCheck = std::function<std::vector<WordProblem>(const std::vector<std::string>& command)>;

/// Reads a suite. `name` is used as the file name in messages. Throws Error(kInput) listing all problems with their
/// lines, including those that `check`, if given, finds in its commands.
Suite parse_suite(const std::string& text, const std::string& name, const CommandCheck& check = {});

/// All problems of the suite as a whole, after overrides; empty if it can be run.
std::vector<std::string> validate(const Suite& suite);
/// Throws Error(kUsage) with all problems, if there are any.
void throw_if_invalid(const Suite& suite);

nlohmann::ordered_json to_json(const Suite& suite);

/// The folder that the suite's scene files are relative to: that of the suite's file, or the current folder for a
/// scene. For a built-in suite, it is searched here, and in the source tree and installation that contain `program`,
/// the path of `covary`. `word` names the suite on the command line. Throws Error(kUsage) if there is none.
std::string scenes_folder(const Suite& suite, const std::string& word, const std::string& program);

/// The folder of the scenes that come with the program: in the current folder, or in the source tree or installation
/// that contain `program`. Throws Error(kUsage) if there is none.
std::string own_scenes_folder(const std::string& program);

// Suites built into the program: suites/*.json of the source tree.

/// Text of each suite by name: "iicv-table1".
const std::map<std::string, std::string_view>& builtin_suites();

}  // namespace covary::lab
