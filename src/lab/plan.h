// SPDX-License-Identifier: Apache-2.0
// From a suite to command lines: what to run, in which order, and the cache keys of results.
#pragma once

#include <algorithm>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "lab/suite.h"

namespace covary::lab {

/// A scene found on disk, with the suite's choices applied.
struct SceneInstance {
  SceneEntry entry;
  std::string file;  ///< path
  std::string hash;  ///< of the content of scene and camera path
  int frame_width = 0, frame_height = 0;
  std::vector<int> frames;  ///< of a sequence; empty: one image
  std::string camera_path;  ///< path, or empty
  CropWindow window;
  /// Options of `covary render` that choose frame, crop, depth and definitions.
  std::vector<std::string> options() const;
  /// The scene's file, or those of all frames.
  std::vector<std::string> scene_files() const;
  size_t n_images() const { return std::max<size_t>(1, frames.size()); }
  uint64_t n_pixels() const { return static_cast<uint64_t>(window.width) * window.height * n_images(); }
};

/// The files of a scene's image: its path or, if the path has a '#', the path of each frame.
std::vector<std::string> files_of(std::span<const int> frames, const std::string& path);

/// A scene of a suite whose files lie in `folder`. Reads only the camera path, which `hash` covers.
SceneInstance located(const SceneEntry& entry, const std::string& folder);

/// Numbers >= 0 between separators ("10,20,30", "240x135"); empty for any other text.
std::vector<int> whole_numbers(const std::string& text, char separator);

/// Frame and window of a scene whose own frame is `width` x `height`. `max_pixels` > 0 scales down to this many pixels
/// a frame that the suite neither sizes nor crops. Throws Error(kUsage) for texts that are not a size or crop, or a
/// crop outside the frame.
void place(SceneInstance& scene, int width, int height, int64_t max_pixels);

/// One child process: a render and the commands that follow it.
struct Run {
  size_t scene = 0, method = 0, budget = 0;  ///< indices into the suite; method and budget are unused for references
  uint64_t seed = 0;
  std::vector<std::string> options;      ///< of `covary render SCENE`, without outputs
  std::string program;                   ///< shell command that makes the image of what was rendered; or empty
  bool renders = true;                   ///< before the program
  double samples = 0;                    ///< per pixel, of a run that does not render; 0: unknown
  std::vector<std::string> environment;  ///< "NAME=value" for that command: what the run is
  std::vector<std::vector<std::string>> then;
  std::vector<int> frames;  ///< as in SceneInstance
  double work = 0;          ///< samples, for the time left
  bool timed = false;       ///< with a budget in seconds: an interrupted run begins again
  std::string key;          ///< names the result: hash of program, scene, options, seed
  std::string passes_key;   ///< the same for all runs that can share the films of their passes
};

/// Commands of the user's, for the shell, by the names that methods have for them. Suites only hold names, so that a
/// suite of somebody else starts no program.
using Programs = std::map<std::string, std::string>;

/// What is the same for all runs.
struct PlanContext {
  std::string program_version;  ///< part of every key
  /// The options of a method's `covary render` that determine the samples of passes: equal words, equal passes.
  std::function<std::vector<std::string>(const std::vector<std::string>&)> pass_words;
  Programs programs = {};
};

/// Names the command's result: its text, and the contents of the files that its words name.
std::string identity_of_program(const std::string& command);

/// Both halves of the reference that must be rendered for a scene.
std::vector<Run> reference_runs(const Suite& suite, const SceneInstance& scene, const PlanContext& context);

/// All runs of scene number `index`: seeds outermost, so that an interrupted experiment has every method; runs that
/// share passes are adjacent.
std::vector<Run> runs_of_scene(const Suite& suite, size_t index, const SceneInstance& scene,
                               const PlanContext& context);

/// Maximum number of parts that the runs of a scene can be divided into: the halves of a reference to be rendered, and
/// all methods with one seed and budget.
size_t number_of_parts(const Suite& suite, const SceneEntry& scene);

}  // namespace covary::lab
