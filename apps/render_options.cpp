// SPDX-License-Identifier: Apache-2.0
#include "render_options.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <limits>
#include <map>
#include <utility>

#include "command_description.h"
#include "commands.h"
#include "core/error.h"
#include "core/known_names.h"
#include "core/shell_text.h"
#include "declared_options.h"
#include "io/default_sensor.h"
#include "io/scene_formats.h"
#include "io/sensor.h"
#include "method_options.h"
#include "numbers.h"
#include "passes/light_pass.h"
#include "plans/integrator_choice.h"
#include "plans/made_of.h"
#include "render_steps.h"
#include "stages.h"
#include "usage_error.h"
#include "value_names.h"

namespace covary {
namespace fs = std::filesystem;

namespace {

/// The files of the small scenes, by name, in the program's installation or source tree.
std::map<std::string, std::string> builtin_scenes() {
  const fs::path beside = fs::path(program_path()).parent_path();
  std::map<std::string, std::string> files;
  std::error_code ignored;
  for (const fs::path& tree : {beside / ".." / "share" / "covary", beside / ".." / ".."})
    for (const fs::directory_entry& entry : fs::directory_iterator(tree / "scenes", ignored))
      if (const fs::path& file = entry.path(); is_scene_file(file.string()))
        files.emplace(file.stem().string(), file.lexically_normal().string());
  return files;
}

}  // namespace

std::vector<std::string> builtin_scene_names() {
  std::vector<std::string> names;
  for (const auto& [name, path] : builtin_scenes()) names.push_back(name);
  return names;
}

namespace {

/// A word that is no file's name, and no scene's, is an error.
void check_scene_name(const std::string& word) {
  if (fs::exists(word)) return;
  const fs::path given = word;
  if (const std::string stem = given.stem().string(); given.has_extension() && builtin_scenes().contains(stem))
    throw Error(ErrorCode::kIo, fmt::format("there is no file '{}'; the built-in scene is called '{}'", word, stem));
  if (given.filename() != word || given.has_extension()) return;
  const std::vector<std::string> names = builtin_scene_names();
  throw Error(ErrorCode::kIo,
              fmt::format("there is no file '{}', and no built-in scene of that name", word) +
                  hint_and_list(
                      word, names,
                      fmt::format("built-in are {}", names.empty() ? "none" : fmt::to_string(fmt::join(names, ", ")))));
}

}  // namespace

void check_options(RenderOptions& options) {
  check_scene_name(options.scene);
  options.settings = settings_from<RenderSettings>(options.values);
  options.sequence = settings_from<SequenceSettings>(options.of_sequence);
  if (std::string& path = options.sequence.camera_path; !path.empty() && !fs::exists(path))
    if (const fs::path beside = fs::path(options.scene).parent_path() / path; fs::exists(beside))
      path = beside.string();
  RenderSettings& settings = options.settings;
  if (!options.is_replay() && settings.request.output.empty())
    usage("no output given; use -o OUT.exr (or --replay X,Y,SAMPLE)");
  if (const fs::path output = settings.request.output; !options.is_replay() && output.extension() == ".png")
    usage(fmt::format("-o '{}': the name must end in .exr; with -o '{}', '{}' is written, too, to look at",
                      output.string(), fs::path(output).replace_extension(".exr").string(), output.string()));
  const Method method = estimator_of(options);
  check_given(options.values, settings, method);
  check_stages(options.stages, method);
}

namespace {

/// Options of the render that some integrators do not use.
void check_integrator(const RenderOptions& options, const LoadedScene& scene) {
  const std::string& name = options.settings.integrator.empty() ? scene.integrator_type : options.settings.integrator;
  if (options.replays_light() && !integrator_of(scene).light_tracing())
    throw Error(ErrorCode::kUsage,
                fmt::format("--replay light is for integrators that trace light; '{}' does not", name));
  if (options.request().path_lengths && !integrator_of(scene).longest_path())
    throw Error(ErrorCode::kUsage,
                fmt::format("--layers path-lengths is for --integrator controlled-path, not {}", name));
}

}  // namespace

LoadedScene load(const RenderOptions& options) {
  LoadOptions loading = load_options(options.scene_options);
  loading.width = options.settings.width, loading.height = options.settings.height;
  loading.view = options.settings.view;
  if (scene_format_of(options.scene).moves_in_seconds) loading.time = time_of_frame(options);
  loading.make_integrator = integrator_maker({options.settings.integrator, options.of_integrator});
  LoadedScene scene = load_scene(options.scene, loading);
  check_integrator(options, scene);
  const auto is_settled = [&](const std::string& warning) {  // by options
    const auto says = [&](const char* text) { return warning.find(text) != std::string::npos; };
    return (!options.sequence.camera_path.empty() && says(kFramed)) ||
           (options.request().alpha && says(kAlphaOnDemand));
  };
  std::erase_if(scene.warnings, is_settled);
  for (std::string& warning : integrator_of(scene).blind_spots(*scene.scene))
    scene.warnings.push_back(std::move(warning));
  return scene;
}

Method estimator_of(const RenderOptions& options) { return estimator_of(options.settings, options.of_estimator); }

Plan make_plan(const RenderOptions& options) { return render_plan(options.settings, options.of_estimator); }

RenderRequest make_request(const RenderOptions& options, const LoadedScene& scene) {
  RenderRequest request = request_of(options.settings, scene);
  if (options.replay.empty() && request.load_training.empty()) take_training(scene, request);
  request.attributes = {{film_key::kVersion, COVARY_VERSION},
                        {film_key::kCommand, command_line()},
                        {film_key::kMadeOf, made_of(options, scene)}};
  return request;
}

std::string made_of(const RenderOptions& options, const LoadedScene& scene, const OptionValues& of_frame) {
  OptionValues of_file;
  if (!options.scene_options.defines.empty())
    of_file["define"] = fmt::format("{}", fmt::join(options.scene_options.defines, " "));
  if (options.scene_options.ignore_unknown) of_file["ignore-unknown"] = "";
  return made_of(scene.content_hash, {options.values, options.of_integrator, options.of_estimator, of_file, of_frame});
}

uint64_t replayed_light_path(const RenderOptions& options) {
  const std::string number = options.replay.substr(std::min(options.replay.size(), std::strlen("light,")));
  return static_cast<uint64_t>(parse_numbers("--replay", number, ',', 1, "light,PATH, e.g. light,17")[0]);
}

std::vector<SampleAddress> replayed_samples(const RenderOptions& options) {
  const bool with_pass = std::count(options.replay.begin(), options.replay.end(), ',') == 3;
  const auto at = parse_numbers("--replay", options.replay, ',', with_pass ? 4 : 3,
                                "X,Y,SAMPLE, e.g. 640,360,17, or X,Y,SAMPLE,PASS");
  if (std::max(at[0], at[1]) > std::numeric_limits<int>::max() ||
      (with_pass && at[3] > std::numeric_limits<uint32_t>::max()))
    throw Error(ErrorCode::kUsage, fmt::format("--replay '{}': a number is too large", options.replay));
  SampleAddress address;
  address.sampling = options.settings.passes.sampling;
  address.x = static_cast<int>(at[0]), address.y = static_cast<int>(at[1]);
  address.sample = static_cast<uint64_t>(at[2]);
  if (with_pass) address.pass = static_cast<uint32_t>(at[3]);
  address.groups = options.settings.passes.groups;
  if (!estimator_of(options).pair()) return {address};
  address.sampling = Sampling::kIndependent;
  std::vector<SampleAddress> both(2, address);
  both[0].sampling = Sampling::kCrn;
  return both;
}

namespace {

void add_output_options(CLI::App& command, RenderOptions& o) {
  command.option_defaults()->group("Output");
  add_value(command, "--display-server", o.display_server, kServerValue,
            "Show the image in a running tev while rendering");
  add_live_options(command, o.live, "Show the image, its error and the time left in the browser while rendering");
  add_stages_option(command, o.stages);
  add_value(command, "--replay", o.replay, "X,Y,SAMPLE[,PASS]|light,PATH",
            "Instead of rendering, print one sample of each film, or what a light path adds");
  command.option_defaults()->group(kBasicOptions);
}

}  // namespace

namespace {

/// The scene files of a folder and of those in it.
std::string scenes_in(const std::string& folder) {
  constexpr size_t kMax = 5;
  std::vector<std::string> files;
  std::error_code ignored;
  for (fs::recursive_directory_iterator it(folder, ignored), end; it != end; it.increment(ignored)) {
    if (it.depth() > 1) it.disable_recursion_pending();
    if (it.depth() <= 1 && is_scene_file(it->path().string())) files.push_back(it->path().string());
  }
  const auto depth = [](const std::string& path) { return std::count(path.begin(), path.end(), '/'); };
  std::sort(files.begin(), files.end(), [&](const std::string& a, const std::string& b) {
    return std::pair(depth(a), a) < std::pair(depth(b), b);
  });
  if (files.empty()) return fmt::format("which holds no scene ({})", scene_file_endings());
  const size_t more = files.size() - std::min(files.size(), kMax);
  files.resize(files.size() - more);
  return fmt::format("not a scene; give one that it holds: {}{}", shell_text(files),
                     more > 0 ? fmt::format(" and {} more", more) : "");
}

}  // namespace

std::string scene_file(const std::string& word) {
  std::error_code ignored;
  const bool is_folder = fs::is_directory(word, ignored);
  if (!is_folder && (fs::exists(word) || fs::path(word).filename() != word)) return word;
  const std::map<std::string, std::string> files = builtin_scenes();
  const auto found = files.find(word);
  if (found != files.end()) return found->second;
  if (is_folder) throw Error(ErrorCode::kUsage, fmt::format("'{}' is a folder, {}", word, scenes_in(word)));
  return word;
}

std::string program_path() { return fs::read_symlink("/proc/self/exe").string(); }

void add_render_options(CLI::App& command, RenderOptions& o) {
  command
      .add_option("SCENE", o.scene,
                  fmt::format("Scene: {}; or the name of a built-in one, such as room", scene_format_names()))
      ->transform(scene_file)
      ->required();
  add_options(command, options_of<RenderSettings>(), o.values);
  add_scene_options(command, o.scene_options);
  add_threads_option(command, o.threads);
  add_value(command, "--json", o.json, kFileValue, "Statistics; '-': to standard output");
  command.add_flag("--quiet", o.quiet, "No progress and no summary");
  command.add_flag("--verbose", o.verbose, "In the summary, also speeds and the predicted error with its interval");
  add_output_options(command, o);
  add_options(command, options_of<SequenceSettings>(), o.of_sequence);
  add_method_options(command, {{options_of_integrators(), &o.of_integrator},
                               {options_of_estimators(estimator_names()), &o.of_estimator}});
}

}  // namespace covary
