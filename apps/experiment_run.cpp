// SPDX-License-Identifier: Apache-2.0
#include "experiment_run.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "combine/registry.h"
#include "commands.h"
#include "core/content_hash.h"
#include "core/error.h"
#include "core/number_text.h"
#include "core/stopwatch.h"
#include "core/unfinished.h"
#include "film/outputs.h"
#include "imageio/output_file.h"
#include "imageio/output_folder.h"
#include "interruption.h"
#include "json_output.h"
#include "lab/report_document.h"
#include "lab/suite.h"
#include "lab/time_estimate.h"
#include "progress.h"
#include "render_options.h"
#include "unknown_argument.h"
#include "version.h"

namespace covary {
namespace {

namespace fs = std::filesystem;

/// Version and commit; plus a hash of the program's content if the commit does not identify the build.
std::string program_version() {
  std::string text = version_text();
  if (!text.ends_with(')') || text.ends_with("-dirty)")) text += " " + hash_text(hash_bytes(read_file(program_path())));
  return text;
}

/// A method's options parsed as by `covary render`, with or without frames.
RenderOptions parsed(std::vector<std::string> words, bool of_frames) {
  CLI::App command;
  RenderOptions options;
  add_render_options(command, options);
  words.insert(words.end(), {"scene.xml", "-o", "out_#.exr"});
  if (of_frames) words.insert(words.end(), {"--frames", "1"});
  std::reverse(words.begin(), words.end());
  try {
    command.parse(words);
  } catch (const CLI::ExtrasError&) {
    const bool is_option =
        std::ranges::any_of(command.remaining(true), [](const std::string& word) { return word.starts_with('-'); });
    throw Error(ErrorCode::kUsage, is_option ? unknown_argument(command, "covary render")
                                             : fmt::format("'{}' belongs to no option", options.scene));
  }
  return options;
}

/// The experiment's progress, on a separate line, with the time left while a run takes long; failures stay above it.
void show_progress(const lab::Progress& p, const std::string& name, ProgressLine& line) {
  if (p.kind == lab::Progress::Kind::kFailed) {
    line.print(fmt::format("failed: {}{}", name, p.what));
    return;
  }
  if (p.total == 0) return line.show([p, name] { return name + p.what; });  // before the runs are known
  line.show([p, name, since = Stopwatch()] {
    const double left = p.seconds_left - since.seconds();
    return fmt::format("[{}/{}{}] {}{}", p.done, p.total,
                       left > 0               ? ", " + format_duration(left) + " left"
                       : p.seconds_left > 0   ? ", longer than expected"
                       : since.seconds() >= 1 ? ", " + format_duration(since.seconds()) + " so far"
                                              : "",
                       name, p.what);
  });
}

lab::PlanContext plan_context(const lab::Programs& programs) {
  return {program_version(),
          [](const std::vector<std::string>& words) {
            const RenderOptions options = parsed(words, true);
            return pass_words(options.values, options.of_integrator, options.of_estimator);
          },
          programs};
}

/// Whether the file holds results of an experiment: "format" is the first key.
bool is_results(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::string text(200, '\0');
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  return text.find(lab::kResultsFormat) != std::string::npos;
}

}  // namespace

std::string read_file(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw Error(ErrorCode::kIo, "cannot open '" + path + "'");
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

void check_scenes(const lab::Suite& suite, const std::string& name, const std::string& folder) {
  std::vector<std::string> missing;
  size_t n_complete = 0;
  for (const lab::SceneEntry& scene : suite.scenes) {
    const size_t before = missing.size();
    for (const std::string& file : lab::located(scene, folder).scene_files())
      if (!fs::exists(file)) missing.push_back(file);
    n_complete += missing.size() == before;
  }
  if (missing.empty()) return;
  if (!lab::builtin_suites().contains(name))
    throw Error(ErrorCode::kIo,
                fmt::format("'{}': there {} no {}; --scenes names the folder that the suite's files are in", name,
                            missing.size() == 1 ? "is" : "are", fmt::join(missing, ", no ")));
  if (n_complete > 0) return;  // these can be compared
  throw Error(ErrorCode::kIo,
              fmt::format("'{0}' has none of the scenes of {1}; `covary scenes {1} --folder {0}` says which "
                          "are missing, and `covary scenes {1}` where they come from",
                          folder, name));
}

void check_files(const ExperimentCommand& command, const lab::Suite& suite, const std::string& scenes,
                 const std::string& folder) {
  Outputs outputs;
  outputs.reads(command.suite);
  for (const lab::SceneEntry& scene : suite.scenes) {
    const lab::SceneInstance located = lab::located(scene, scenes);
    outputs.reads(located.scene_files());
    if (!located.camera_path.empty()) outputs.reads(located.camera_path);
    for (const std::string& file : suite.reference_of(scene).files)
      outputs.reads(lab::files_of(located.frames, (fs::path(scenes) / file).string()));
  }
  outputs.writes("-o", folder + kResults, OutputKind::kText);
  outputs.writes("-o", folder + kTable, OutputKind::kText);
  outputs.writes("-o", folder + kReport, OutputKind::kPage);
  for (const char* name : {kResults, kTable, kReport})
    if (fs::exists(folder + name) && !is_results(folder + kResults))
      throw Error(
          ErrorCode::kUsage,
          fmt::format("-o '{0}': {0}{1} exists and was not made by an experiment; give another folder, or one that an "
                      "experiment has written to",
                      folder, name));
}

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
      problems.push_back(
          fmt::format("method '{}' is made by a program of your own: give --{} {}=COMMAND (in Python "
                      "{}={{\"{}\": function}})",
                      method.name, method.renders ? "program" : "renderer", method.program,
                      method.renders ? "methods" : "renderers", method.program));
  }
  if (!problems.empty()) throw Error(ErrorCode::kUsage, fmt::format("{}", fmt::join(problems, "\n")));
}

lab::ExperimentOptions run_options(const ExperimentCommand& command, const std::string& scenes,
                                   const lab::Programs& programs) {
  lab::ExperimentOptions options;
  options.program = program_path();
  options.cache_folder = fs::absolute(command.cache.empty() ? command.output + "/cache" : command.cache).string();
  options.scenes_folder = scenes;
  options.context = plan_context(programs);
  options.max_pixels = lab::max_pixels(command.overrides);
  options.threads = command.threads;
  options.keep_passes = command.keep_passes;
  options.part = command.the_part;
  return options;
}

void tell_time(const lab::Suite& suite, lab::ExperimentOptions& options) {
  constexpr double kLong = 180, kMinWork = 1e8;  // seconds, samples
  const StopFlag stop;
  lab::ExperimentOptions trial = options;
  trial.stop = stop.token();
  const lab::TimeEstimate estimate = lab::TimeEstimator(trial).of(suite, options.max_pixels, kMinWork);
  if (trial.stop->load()) throw Unfinished(kInterrupted, "interrupted before the first run");
  options.expected_seconds = estimate.seconds;
  if (estimate.seconds < kLong) return;
  const uint32_t reference = suite.reference.files.empty() ? suite.reference.spp : 0;
  fmt::print(stderr,
             "about {} for {}{}, by the speed of path tracing on cores without other work; {}"
             "--resolution and {}take less\n",
             format_duration(estimate.seconds), counted(static_cast<long>(estimate.runs - estimate.finished), "run"),
             estimate.finished > 0 ? fmt::format(" ({} made before)", estimate.finished) : "",
             options.max_pixels == 0 ? "--quick, " : "",
             reference > 0 ? fmt::format("--reference-spp (two of {}) ", reference) : "fewer --seeds ");
}

lab::Results run_suite(const lab::Suite& suite, lab::ExperimentOptions options, const std::string& name, bool quiet) {
  ProgressLine progress("", quiet);
  const StopFlag stop;
  options.stop = stop.token();
  options.progress = [&](const lab::Progress& p) { show_progress(p, name, progress); };
  return lab::run_experiment(suite, options);
}

Written write_results(lab::Results results, const std::string& version, const std::string& folder) {
  results.version = version;
  results.command = command_line();
  results.date = fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr)));
  results.machine = lab::machine_facts();
  const nlohmann::ordered_json json = to_json(results);
  write_text_file(folder + kResults, json_text(json, 1));
  write_text_file(folder + kTable, lab::to_csv(json));
  Written written{std::move(results), {}, {}};
  written.document = lab::report_document(written.results);
  lab::add_pictures(written.results, written.document, written.pictures);
  write_report(folder + kReport, written.document, written.pictures);
  return written;
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

void throw_if_failed(size_t n_failures, const ExperimentCommand& command) {
  if (n_failures == 0) return;
  throw Error(
      ErrorCode::kInput,
      fmt::format("{} of the experiment's parts failed; {} which and why, and the same command tries them again",
                  n_failures, command.the_part.of == 0 ? command.output + "/results.json says" : "above stands"));
}

}  // namespace covary
