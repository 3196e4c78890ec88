// SPDX-License-Identifier: Apache-2.0
// covary merge: the film of all samples of several films.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "combine/registry.h"
#include "commands.h"
#include "core/shell_text.h"
#include "declared_options.h"
#include "estimators/mean.h"
#include "film/film_file.h"
#include "film/image_file.h"
#include "film/merge.h"
#include "film/outputs.h"
#include "frame_checks.h"
#include "plans/plan.h"
#include "progress.h"
#include "sequences/frame_names.h"
#include "value_names.h"

namespace covary {
namespace {

namespace fs = std::filesystem;

struct MergeOptions {
  std::vector<std::string> inputs;
  std::string output;
  bool overwrite = false;
};

// ---- images that hold no samples
// -------------------------------------------------------------------------------------

std::string attribute(const ImageInfo& info, const std::string& name) {
  const auto found = info.attributes.find("covary:" + name);
  return found == info.attributes.end() ? "" : found->second;
}

/// Whether the file is the image of a render rather than a film.
bool is_result(const ImageInfo& info) {
  return attribute(info, "film").empty() && !attribute(info, "estimator").empty();
}

/// The folder with the films of an image: the --passes of its command, relative to here or to the image, or the one
/// that an interrupted render leaves.
std::optional<fs::path> folder_of_films(const std::string& path, const ImageInfo& info) {
  const std::vector<std::string> words = words_of_shell_text(attribute(info, "command"));
  std::vector<fs::path> candidates;
  if (const auto option = std::find(words.begin(), words.end(), "--passes");
      option != words.end() && option + 1 != words.end())
    candidates = {option[1], fs::path(path).parent_path() / option[1]};
  candidates.push_back(fs::path(path).replace_extension(".passes"));
  for (const fs::path& folder : candidates)
    if (fs::exists(folder / "independent.exr")) return folder;
  return std::nullopt;
}

/// Commands that merge the films in these folders and make one image of the result.
std::vector<std::string> commands_of_films(const std::vector<fs::path>& folders, const std::string& output,
                                           const std::string& estimator) {
  std::vector<std::string> commands, combine{"covary", "combine"};
  for (const std::string kind : {"crn", "independent", "light"}) {
    std::vector<std::string> words{"covary", "merge"};
    for (const fs::path& folder : folders)
      if (const fs::path film = folder / (kind + ".exr"); fs::exists(film)) words.push_back(film.string());
    if (words.size() != folders.size() + 2) continue;
    words.insert(words.end(), {"-o", kind + ".exr"});
    commands.push_back(shell_text(words));
    combine.insert(combine.end(), {"--" + kind, kind + ".exr"});
  }
  combine.insert(combine.end(), {"-o", output});
  if (estimator != kDefaultEstimator) combine.insert(combine.end(), {"--estimator", estimator});
  commands.push_back(shell_text(combine));
  return commands;
}

/// If an input is an image without samples: what to merge instead. Throws Error(kInput).
void advise_on_images(const MergeOptions& options) {
  std::vector<std::string> commands;
  std::vector<fs::path> folders;
  std::string first, estimator;
  for (const std::string& path : options.inputs) {
    const ImageInfo info = inspect_image(path);
    if (!is_result(info)) continue;
    if (first.empty()) {
      first = path, estimator = attribute(info, "estimator");
      estimator = estimator.substr(0, estimator.find(' '));
    }
    if (const std::optional<fs::path> folder = folder_of_films(path, info)) folders.push_back(*folder);
    const std::string folder = fs::path(path).replace_extension(".films").string();
    if (const std::string command = attribute(info, "command"); command.starts_with("covary render "))
      commands.push_back(command + " --passes " + shell_text({folder}));
  }
  if (first.empty()) return;
  const bool all_kept = folders.size() == options.inputs.size();
  if (all_kept) commands = commands_of_films(folders, options.output, estimator);
  std::string advice = all_kept           ? "; its films are there, so merge these and combine them:"
                       : commands.empty() ? "; merge the films that it was made of"
                                          : "; render with --passes, which keeps the films, and merge these:";
  for (const std::string& command : commands) advice += "\n  " + command;
  throw Error(ErrorCode::kInput,
              fmt::format("{} is not a film but an image that '{}' made from films, without samples that could be "
                          "merged{}",
                          first, estimator, advice));
}

void refuse_frames(const MergeOptions& options) {
  for (const std::string& path : options.inputs)
    if (is_frame_pattern(path) && !fs::exists(path))
      throw Error(ErrorCode::kUsage,
                  fmt::format("'{}': frames are merged one by one; to denoise them, give all renders without merging:\n"
                              "  {}",
                              path,
                              shell_text({"covary", "denoise", options.inputs[0], options.inputs[1], "-o",
                                          "denoised_####.exr"})));
}

Film merged_films(const MergeOptions& options) {
  try {
    return merge_film_files(options.inputs);
  } catch (const Error& error) {
    if (error.code() == ErrorCode::kInput) advise_on_images(options);
    throw;
  }
}

void merge(const MergeOptions& options) {
  refuse_frames(options);
  Outputs outputs;
  outputs.reads(options.inputs);
  outputs.writes_result("-o", options.output, OutputKind::kFilm, "merge", options.overwrite);
  Film merged = merged_films(options);
  warn_of_unfinished(options.inputs);
  merged.attributes[film_key::kVersion] = COVARY_VERSION;
  merged.attributes[film_key::kCommand] = command_line();
  write_film(options.output, merged, mean_of_groups(rows_of(merged, 0, merged.height())).std_error);
  fmt::print(stderr, "{}: {} x {} pixels, {}\n", options.output, merged.width(), merged.height(),
             samples_per_pixel_text(merged.mean_count()));
}

}  // namespace

void add_merge(CLI::App& app) {
  const auto options = std::make_shared<MergeOptions>();
  CLI::App* command = app.add_subcommand("merge", "Merge films of one scene with different seeds into one film");
  add_value(*command, "FILMS", options->inputs, kFileValue,
            fmt::format("Films (EXR), written by covary render --passes or --estimator {}", kNoEstimator))
      ->required()
      ->expected(2, 100000);
  add_value(*command, "-o,--output", options->output, kFileValue, "The merged film (EXR)")->required();
  add_overwrite_option(*command, options->overwrite);
  command->callback([options] { merge(*options); });
}

}  // namespace covary
