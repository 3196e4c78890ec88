// SPDX-License-Identifier: Apache-2.0
// covary experiment: scenes x methods x budgets x seeds, measured, as results and a report.
#include <fmt/chrono.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <memory>
#include <sstream>

#include "combine/registry.h"
#include "commands.h"
#include "core/content_hash.h"
#include "core/error.h"
#include "declared_options.h"
#include "film/output_file.h"
#include "film/outputs.h"
#include "interruption.h"
#include "io/scene_file.h"
#include "json_output.h"
#include "lab/experiment.h"
#include "lab/overrides.h"
#include "lab/report_document.h"
#include "lab/suite.h"
#include "numbers.h"
#include "progress.h"
#include "render_options.h"
#include "suite_words.h"
#include "value_names.h"
#include "version.h"

namespace covary {
namespace {

namespace fs = std::filesystem;

struct ExperimentCommand {
  std::string suite, output, cache, scenes;
  std::string seeds, part;
  std::vector<uint32_t> spp;
  std::vector<double> seconds;
  std::vector<std::string> programs, renderers;
  lab::Overrides overrides;
  int threads = 0;
  bool list = false, print = false, keep_passes = false, quiet = false;
};

std::string read_file(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw Error(ErrorCode::kIo, "cannot open '" + path + "'");
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

/// Version and commit; plus a hash of the program's content if the commit does not identify the build.
std::string program_version() {
  std::string text = version_text();
  if (!text.ends_with(')') || text.ends_with("-dirty)")) text += " " + hash_text(hash_bytes(read_file(program_path())));
  return text;
}

// ---- the suite
// -------------------------------------------------------------------------------------------------------

void list_suites() {
  for (const auto& [name, text] : lab::builtin_suites()) {
    const lab::Suite suite = lab::parse_suite(std::string(text), name);
    fmt::print("{:18} {}\n", name, suite.title);
  }
}

lab::Suite builtin(const std::string& name) {
  const auto found = lab::builtin_suites().find(name);
  if (found != lab::builtin_suites().end()) return lab::parse_suite(std::string(found->second), name + ".json");
  std::vector<std::string> names;
  for (const auto& [known, text] : lab::builtin_suites()) names.push_back(known);
  throw Error(ErrorCode::kUsage, fmt::format("no suite is named '{}'{}; expected SUITE.json, SCENE.xml or one of {}",
                                             name, did_you_mean(name, names), fmt::join(names, ", ")));
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

// ---- progress
// --------------------------------------------------------------------------------------------------------

/// The experiment's progress, on a separate line; failures stay above it.
void show_progress(const lab::Progress& p, ProgressLine& line) {
  if (p.kind == lab::Progress::Kind::kFailed) {
    line.clear();
    fmt::print(stderr, "failed: {}\n", p.what);
    return;
  }
  const std::string left = p.seconds_left > 0 ? ", " + format_duration(p.seconds_left) + " left" : "";
  line.show(fmt::format("[{}/{}{}] {}", p.done, p.total, left, p.what));
}

// ---- the command
// -----------------------------------------------------------------------------------------------------

/// A method's options parsed as by `covary render`, with or without frames.
RenderOptions parsed(std::vector<std::string> words, bool of_frames) {
  CLI::App command;
  RenderOptions options;
  add_render_options(command, options);
  words.insert(words.end(), {"scene.xml", "-o", "out_#.exr"});
  if (of_frames) words.insert(words.end(), {"--frames", "1"});
  std::reverse(words.begin(), words.end());
  command.parse(words);
  return options;
}

lab::PlanContext plan_context(const lab::Programs& programs) {
  return {program_version(),
          [](const std::vector<std::string>& words) {
            const RenderOptions options = parsed(words, true);
            return pass_words(options.values, options.of_integrator, options.of_estimator);
          },
          programs};
}

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

/// A method for each program that none of the suite's refers to: it gets independent samples in groups, and guides; or
/// renders itself.
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

constexpr const char *kResults = "/results.json", *kTable = "/results.csv", *kReport = "/report.html";

/// Whether the file holds results of an experiment: "format" is the first key.
bool is_results(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::string text(200, '\0');
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  return text.find(lab::kResultsFormat) != std::string::npos;
}

/// Before the experiment begins: results must not overwrite anything that it reads, or unrelated files.
void check_files(const ExperimentCommand& command, const lab::Suite& suite, const std::string& scenes) {
  Outputs outputs;
  outputs.reads(command.suite);
  for (const lab::SceneEntry& scene : suite.scenes) {
    const lab::SceneInstance located = lab::located(scene, scenes);
    outputs.reads(located.scene_files());
    if (!located.camera_path.empty()) outputs.reads(located.camera_path);
    for (const std::string& file : suite.reference_of(scene).files)
      outputs.reads(lab::files_of(located.frames, (fs::path(scenes) / file).string()));
  }
  outputs.writes("-o", command.output + kResults, OutputKind::kText);
  outputs.writes("-o", command.output + kTable, OutputKind::kText);
  outputs.writes("-o", command.output + kReport, OutputKind::kPage);
  for (const char* name : {kResults, kTable, kReport})
    if (fs::exists(command.output + name) && !is_results(command.output + kResults))
      throw Error(
          ErrorCode::kUsage,
          fmt::format("-o '{0}': {0}{1} exists and was not made by an experiment; give another folder, or one that an "
                      "experiment has written to",
                      command.output, name));
}

/// Checks that all programs are given, and parses each method's options as `covary render` will, so that nothing runs
/// unless all are valid. run_experiment() reports other mistakes of the suite.
void check_methods(const lab::Suite& suite, const lab::Programs& programs) {
  if (!lab::validate(suite).empty()) return;
  const bool of_frames = std::any_of(suite.scenes.begin(), suite.scenes.end(),
                                     [](const lab::SceneEntry& scene) { return !scene.frames.empty(); });
  std::vector<std::string> problems;
  for (const lab::MethodEntry& method : suite.methods) {
    std::vector<std::string> words = suite.common_options;
    words.insert(words.end(), method.options.begin(), method.options.end());
    try {
      RenderOptions options = parsed(words, of_frames);
      check_options(options);
    } catch (const std::runtime_error& error) {
      problems.push_back(fmt::format("method '{}': {}", method.name, error.what()));
    }
    if (!method.program.empty() && !programs.contains(method.program))
      problems.push_back(fmt::format("method '{}' is made by a program of your own: give --{} {}=COMMAND", method.name,
                                     method.renders ? "program" : "renderer", method.program));
  }
  if (!problems.empty()) throw Error(ErrorCode::kUsage, fmt::format("{}", fmt::join(problems, "\n")));
}

void write_results(const lab::Results& results, const std::string& folder) {
  const nlohmann::ordered_json json = to_json(results);
  write_text_file(folder + kResults, json_text(json, 1));
  write_text_file(folder + kTable, lab::to_csv(json));
  nlohmann::ordered_json document = lab::report_document(results);
  std::vector<ReportImage> images;
  lab::add_pictures(results, document, images);
  write_report(folder + kReport, document, images);
}

void print_summary(const lab::Results& results, const std::string& folder) {
  const lab::Suite& suite = results.suite;
  fmt::print(stderr, "{:20} {:>10} {:>10} {:>12} {:>14} {:>14}\n", "method", "budget", "spp taken", "relMSE",
             "equal samples", "equal time");
  const auto factor = [](double value) {
    return std::isfinite(value) ? fmt::format("{:.2f}x", value) : std::string("-");
  };
  for (const lab::Summary& s : results.summaries)
    fmt::print(stderr, "{:20} {:>10} {:>10.4g} {:>12.4g} {:>14} {:>14}\n", suite.methods[s.method].name,
               suite.budgets[s.budget].label(), s.samples_per_pixel, s.relmse, factor(s.equal_sample.value),
               factor(s.equal_time.value));
  for (const std::string& verdict : lab::verdicts(results, lab::shown_budget(suite)))
    fmt::print(stderr, "{}\n", verdict);
  for (const std::string& warning : results.warnings) fmt::print(stderr, "warning: {}\n", warning);
  fmt::print(stderr, "{}/report.html, results.json, results.csv\n", folder);
}

void finish(lab::Results& results, const std::string& version, const ExperimentCommand& command) {
  results.version = version;
  results.command = command_line();
  results.date = fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr)));
  results.machine = lab::machine_facts();
  write_results(results, command.output);
  if (!command.quiet) print_summary(results, command.output);
}

void experiment(ExperimentCommand command) {
  if (command.list) return list_suites();
  if (command.suite.empty())
    throw Error(ErrorCode::kUsage, "no suite given; expected SUITE.json, SCENE.xml or a name that --list shows");
  if (!command.seeds.empty()) command.overrides.seeds = parse_seeds(command.seeds);
  for (uint32_t spp : command.spp) command.overrides.budgets.push_back({spp, 0});
  for (double seconds : command.seconds) command.overrides.budgets.push_back({0, seconds});
  const lab::Part part = parse_part(command.part);
  lab::Programs programs, renderers;
  add_programs("--program", command.programs, programs);
  add_programs("--renderer", command.renderers, renderers);
  command.suite = scene_file(command.suite);  // `room` is a scene, too
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
  std::error_code error;
  fs::create_directories(command.output, error);
  if (error) throw Error(ErrorCode::kIo, fmt::format("cannot make the folder {}: {}", command.output, error.message()));

  const std::string scenes =
      command.scenes.empty() ? lab::scenes_folder(suite, command.suite, program_path()) : command.scenes;
  check_files(command, suite, scenes);
  ProgressLine progress("", command.quiet);
  lab::ExperimentOptions options;
  options.program = program_path();
  options.cache_folder = fs::absolute(command.cache.empty() ? command.output + "/cache" : command.cache).string();
  options.scenes_folder = scenes;
  options.context = plan_context(programs);
  options.max_pixels = command.overrides.quick ? lab::kQuickPixels : 0;
  options.threads = command.threads;
  options.keep_passes = command.keep_passes;
  options.part = part;
  std::optional<StopFlag> stop(std::in_place);
  options.stop = stop->token();
  options.progress = [&](const lab::Progress& p) { show_progress(p, progress); };
  lab::Results results = lab::run_experiment(suite, options);
  stop.reset();
  progress.finish();
  if (part.of == 0) finish(results, options.context.program_version, command);
  if (!results.failures.empty())
    throw Error(ErrorCode::kInput, fmt::format("{} of the experiment's parts failed; {} which and why, and the same "
                                               "command tries them again",
                                               results.failures.size(),
                                               part.of == 0 ? command.output + "/results.json says" : "above stands"));
}

}  // namespace

void add_experiment(CLI::App& app) {
  const auto o = std::make_shared<ExperimentCommand>();
  CLI::App* command = app.add_subcommand("experiment", "Compare methods over scenes, budgets and seeds");
  add_value(*command, "SUITE", o->suite, kFileValue, "A suite (JSON), a scene (XML), or the name of a built-in suite");
  add_value(*command, "-o,--output", o->output, kFolderValue, "Folder for report.html, results.json and results.csv");
  command->add_flag("--list", o->list, "List the built-in suites");
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
  add_value(*command, "--cache", o->cache, kFolderValue,
            "Folder of finished runs; default: cache in the output folder");
  command->add_flag("--quick", o->overrides.quick,
                    "Small: 3 seeds, up to 192 samples per pixel, frames of up to 32400 pixels, crops of up to 12000");
  const auto list = [](CLI::Option* option) { option->delimiter(',')->group("Overriding the suite"); };
  const auto single = [](CLI::Option* option) { option->group("Overriding the suite"); };
  single(add_value(*command, "--seeds", o->seeds, "SEEDS", "A number of seeds, or seeds separated by commas"));
  list(command->add_option("--spp", o->spp, "Budgets in samples per pixel")->transform(whole_number(1u, 1u << 30)));
  list(command->add_option("--time", o->seconds, "Budgets in seconds")->check(positive_number()));
  single(add_value(*command, "--crop", o->overrides.crop, "X,Y,WIDTH,HEIGHT",
                   "X,Y,WIDTH,HEIGHT, or a centred WIDTHxHEIGHT"));
  single(add_value(*command, "--resolution", o->overrides.resolution, "WIDTHxHEIGHT", "Size of the frames"));
  // Names may hold commas.
  single(add_value(*command, "--scenes-only", o->overrides.scenes, "NAME", "Only these scenes"));
  single(add_value(*command, "--methods-only", o->overrides.methods, "NAME", "Only these methods, and the baseline"));
  single(add_value(*command, "--baseline", o->overrides.baseline, "NAME", "Method that ratios refer to"));
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
