// SPDX-License-Identifier: Apache-2.0
// covary experiment: scenes x methods x budgets x seeds, measured, as results and a report.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <sstream>

#include "combine/registry.h"
#include "commands.h"
#include "core/error.h"
#include "core/known_names.h"
#include "declared_options.h"
#include "experiment_run.h"
#include "imageio/output_folder.h"
#include "io/scene_formats.h"
#include "json_output.h"
#include "lab/suite.h"
#include "numbers.h"
#include "papers/paper.h"
#include "render_options.h"
#include "suite_words.h"
#include "value_names.h"

namespace covary {
namespace {

namespace fs = std::filesystem;

// ---- the suite
// -------------------------------------------------------------------------------------------------------

void list_suites() {
  for (const auto& [name, text] : lab::builtin_suites()) {
    const lab::Suite suite = lab::parse_suite(std::string(text), name);
    fmt::print("{:20} {}\n", name, suite.title);
  }
  for (const auto& [name, text] : lab::builtin_papers()) {
    const lab::Paper paper = lab::parse_paper(std::string(text), name);
    std::vector<std::string> parts;
    for (const lab::PaperPart& part : paper.parts) parts.insert(parts.end(), part.names.begin(), part.names.end());
    fmt::print("{:20} {}; parts: {}\n", name, paper.title, fmt::join(parts, ", "));
  }
}

template <typename Text>
std::vector<std::string> names_of(const std::map<std::string, Text>& texts) {
  std::vector<std::string> names;
  for (const auto& [name, text] : texts) names.push_back(name);
  return names;
}

lab::Suite builtin(const std::string& name) {
  const auto found = lab::builtin_suites().find(name);
  if (found != lab::builtin_suites().end()) return lab::parse_suite(std::string(found->second), name + ".json");
  std::vector<std::string> names = names_of(lab::builtin_suites());
  for (const std::string& paper : names_of(lab::builtin_papers())) names.push_back(paper);
  const std::string expected = fmt::format("expected SUITE.json, a scene (a file, or {}) or one of {}",
                                           fmt::join(builtin_scene_names(), ", "), fmt::join(names, ", "));
  for (const std::string& scene : builtin_scene_names()) names.push_back(scene);
  throw Error(ErrorCode::kUsage, fmt::format("no suite is named '{}'", name) + hint_and_list(name, names, expected));
}

/// The suite, not yet changed by the command's options.
lab::Suite load_suite(const ExperimentCommand& command) {
  const std::string& word = command.suite;
  const fs::path given(word);
  lab::Suite suite;
  if (given.extension() == ".json") {
    suite = lab::parse_suite(read_file(command.suite), command.suite, check_suite_command);
  } else if (is_scene_file(word)) {
    if (!fs::exists(given)) throw Error(ErrorCode::kIo, "cannot open '" + word + "'");
    suite = builtin("compare");
    // A scene called scene.xml is named after its folder.
    const fs::path file = fs::absolute(given);
    const bool common = file.stem().string().starts_with("scene");
    lab::SceneEntry scene;
    scene.name = common ? file.parent_path().filename().string() : file.stem().string();
    scene.file = file.string();
    suite.scenes.push_back(scene);
  } else {
    suite = builtin(command.suite);
  }
  for (lab::SceneEntry& scene : suite.scenes)
    if (fs::path(scene.file).extension().empty()) scene.file = scene_file(scene.file);  // `room`, too
  return suite;
}

/// "5": seeds 1 to 5; "3,4,9": these.
std::vector<uint64_t> parse_seeds(const std::string& text) {
  std::vector<uint64_t> seeds;
  std::stringstream words(text);
  for (std::string word; std::getline(words, word, ',');) {
    const std::optional<uint64_t> seed = parse_number<uint64_t>(word);
    if (!seed)
      throw Error(ErrorCode::kUsage,
                  "--seeds '" + text + "': expected a number of seeds, or seeds separated by commas");
    seeds.push_back(*seed);
  }
  if (seeds.size() != 1 || text.find(',') != std::string::npos) return seeds;
  const uint64_t n = seeds[0];
  if (n < 1 || n > 100000) throw Error(ErrorCode::kUsage, "--seeds '" + text + "': expected 1 to 100000 seeds");
  seeds.clear();
  for (uint64_t s = 1; s <= n; ++s) seeds.push_back(s);
  return seeds;
}

/// "3/8": the third of eight parts.
lab::Part parse_part(const std::string& text) {
  if (text.empty()) return {};
  const std::vector<int64_t> numbers = parse_numbers("--part", text, '/', 2, "K/N, e.g. 3/8");
  if (numbers[0] < 1 || numbers[0] > numbers[1])
    throw Error(ErrorCode::kUsage, "--part '" + text + "': expected K/N with K from 1 to N, e.g. 3/8");
  return {static_cast<size_t>(numbers[0] - 1), static_cast<size_t>(numbers[1])};
}

// ---- the command
// -----------------------------------------------------------------------------------------------------

/// Adds those of --program or --renderer NAME=COMMAND.
void add_programs(const std::string& option, const std::vector<std::string>& words, lab::Programs& programs) {
  for (const std::string& word : words) {
    const size_t equals = word.find('=');
    if (equals == std::string::npos || equals == 0 || equals + 1 == word.size())
      throw Error(ErrorCode::kUsage,
                  fmt::format("{} '{}': expected NAME=COMMAND, e.g. mine='python3 mine.py'", option, word));
    if (!programs.emplace(word.substr(0, equals), word.substr(equals + 1)).second)
      throw Error(ErrorCode::kUsage, fmt::format("{} '{}' is given twice", option, word.substr(0, equals)));
  }
}

/// A method for each program that none of the suite's refers to: it gets independent samples in groups, and
/// features; or renders itself.
void add_methods_of_programs(const lab::Programs& programs, bool renders, lab::Suite& suite) {
  for (const auto& [name, command] : programs) {
    const auto refers = [&](const lab::MethodEntry& method) { return method.program == name; };
    if (std::any_of(suite.methods.begin(), suite.methods.end(), refers)) continue;
    lab::MethodEntry method;
    method.name = method.program = name;
    method.renders = renders;
    if (renders) method.options = {"--estimator", kNoEstimator, "--groups", "8", "--aovs"};
    suite.methods.push_back(method);
  }
}

void experiment(ExperimentCommand command) {
  if (command.list) return list_suites();
  if (command.suite.empty())
    throw Error(ErrorCode::kUsage, "no suite given; expected SUITE.json, a scene or a name that --list shows");
  if (!command.seeds.empty()) command.overrides.seeds = parse_seeds(command.seeds);
  for (uint32_t spp : command.spp) command.overrides.budgets.push_back({spp, 0});
  for (double seconds : command.seconds) command.overrides.budgets.push_back({0, seconds});
  command.the_part = parse_part(command.part);
  if (command.quick) command.overrides.quick.emplace();
  lab::Programs programs, renderers;
  add_programs("--program", command.programs, programs);
  add_programs("--renderer", command.renderers, renderers);
  if (!command.scenes.empty() && !fs::is_directory(command.scenes))
    throw Error(ErrorCode::kIo, "--scenes '" + command.scenes + "': there is no such folder");
  if (const auto paper = lab::builtin_papers().find(command.suite); paper != lab::builtin_papers().end())
    return experiment_paper(command, lab::parse_paper(std::string(paper->second), command.suite + ".json"));
  if (!command.only.empty())
    throw Error(ErrorCode::kUsage, fmt::format("--only chooses parts of a paper ({}); '{}' is a suite",
                                               fmt::join(names_of(lab::builtin_papers()), ", "), command.suite));
  if (!lab::builtin_suites().contains(command.suite)) command.suite = scene_file(command.suite);  // `room`, too
  lab::Suite suite = load_suite(command);
  add_methods_of_programs(programs, true, suite);
  add_methods_of_programs(renderers, false, suite);
  lab::apply(command.overrides, suite);
  for (const auto& [name, text] : renderers)
    if (!programs.emplace(name, text).second)
      throw Error(ErrorCode::kUsage, "--renderer '" + name + "' is the name of a --program, too");
  if (command.print) return write_text_output("-", json_text(lab::to_json(suite)));
  if (command.output.empty()) throw Error(ErrorCode::kUsage, "no folder for the results given; use -o DIR");
  check_methods(suite, programs);
  make_output_folder(command.output);
  const std::string scenes =
      command.scenes.empty() ? lab::scenes_folder(suite, command.suite, program_path()) : command.scenes;
  check_scenes(suite, command.suite, scenes);
  check_files(command, suite, scenes, command.output);
  lab::ExperimentOptions options = run_options(command, scenes, programs);
  if (!command.quiet && command.the_part.of == 0) tell_time(suite, options);
  lab::Results results = run_suite(suite, options, "", command.quiet);
  const size_t n_failures = results.failures.size();
  if (command.the_part.of == 0) {
    const Written written = write_results(std::move(results), options.context.program_version, command.output);
    if (!command.quiet) print_summary(written.results, command.output);
  }
  throw_if_failed(n_failures, command);
}

}  // namespace

void add_experiment(CLI::App& app) {
  const auto o = std::make_shared<ExperimentCommand>();
  CLI::App* command = app.add_subcommand("experiment", "Compare methods over scenes, budgets and seeds");
  add_value(*command, "SUITE", o->suite, kFileValue,
            "A suite (JSON), a scene (Mitsuba, pbrt, glTF), or the name of a built-in suite or paper");
  add_value(*command, "-o,--output", o->output, kFolderValue, "Folder for report.html, results.json and results.csv");
  command->add_flag("--list", o->list, "List the built-in suites and papers");
  command->add_flag("--print", o->print, "Print the suite as it would be run, to start your own from");
  add_value(*command, "--program", o->programs, "NAME=COMMAND",
            "A method of your own: a command that makes the image $COVARY_OUTPUT of what was rendered, $COVARY_IMAGE "
            "and $COVARY_FILMS")
      ->allow_extra_args(false);
  add_value(*command, "--renderer", o->renderers, "NAME=COMMAND",
            "Another renderer, or images that you have: a command that makes the image $COVARY_OUTPUT of the scene "
            "$COVARY_SCENE itself")
      ->allow_extra_args(false);
  add_value(*command, "--scenes", o->scenes, kFolderValue, "Folder of the suite's scene files");
  add_value(*command, "--only", o->only, "PART", "Of a paper: only these parts, e.g. table1,fig9")->delimiter(',');
  add_value(*command, "--cache", o->cache, kFolderValue,
            "Folder of finished runs; default: cache in the output folder");
  command->add_flag("--quick", o->quick,
                    "Small: 3 seeds, up to 192 samples per pixel, frames of up to 32400 pixels, crops of up to 12000; "
                    "of a paper smaller still, for ten minutes");
  const auto single = [](CLI::Option* option) { option->group("Overriding the suite"); };
  add_value(*command, "--seeds", o->seeds, "SEEDS", "A number of seeds, or seeds separated by commas");
  command->add_option("--spp", o->spp, "Budgets in samples per pixel, separated by commas")
      ->transform(whole_number(1u, 1u << 30))
      ->delimiter(',');
  command->add_option("--time", o->seconds, "Budgets in seconds, separated by commas; beside those of --spp")
      ->check(positive_number())
      ->delimiter(',');
  single(add_value(*command, "--crop", o->overrides.crop, "X,Y,WIDTH,HEIGHT",
                   "X,Y,WIDTH,HEIGHT, or a centred WIDTHxHEIGHT"));
  single(add_value(*command, "--resolution", o->overrides.resolution, "WIDTHxHEIGHT", "Size of the frames"));
  single(add_value(*command, "--size", o->overrides.size, "WIDTHxHEIGHT",
                   "Whole frames, in the scene's own shape, of at most as many pixels, e.g. 1280x720"));
  // Names may hold commas: lab::apply() tells which separate names.
  single(add_value(*command, "--scenes-only", o->overrides.scenes, "NAME", "Only these scenes"));
  add_value(*command, "--methods-only", o->overrides.methods, "NAME",
            "Only these methods, separated by commas or spaces, and the baseline");
  add_value(*command, "--baseline", o->overrides.baseline, "NAME", "Method that ratios refer to");
  single(command
             ->add_option("--reference-spp", o->overrides.reference_spp,
                          "Samples per pixel of each of the two halves of the references")
             ->transform(whole_number(1u, 1u << 30)));
  single(add_value(*command, "--reference", o->overrides.reference_files, kFileValue, "One or two references (EXR)")
             ->expected(1, 2));
  add_threads_option(*command, o->threads, "Threads of each render");
  add_value(*command, "--part", o->part, "K/N",
            "K/N: make only the K-th of N parts of the runs; when all are in the cache, the command without "
            "--part measures them");
  command->add_flag("--keep-passes", o->keep_passes, "Keep the films of all passes in the cache");
  command->add_flag("--quiet", o->quiet, "Failures only");
  command->callback([o] { experiment(*o); });
}

}  // namespace covary
