// SPDX-License-Identifier: Apache-2.0
// covary experiment iicv|dependent-tests|controlled-mixtures: the tables and figures of a paper, part by part.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <filesystem>
#include <map>

#include "commands.h"
#include "core/error.h"
#include "experiment_run.h"
#include "film/outputs.h"
#include "imageio/output_file.h"
#include "imageio/output_folder.h"
#include "json_output.h"
#include "lab/time_estimate.h"
#include "papers/paper_report.h"
#include "progress.h"
#include "render_options.h"

namespace covary {
namespace {

/// All scenes that are not at hand, each once, with the parts that lack it.
void print_missing(const std::vector<lab::PreparedPart>& parts, const std::string& folder) {
  struct Missing {
    std::string credit;
    std::vector<std::string> parts;
  };
  std::map<std::string, Missing> all;
  std::vector<std::string> replaced;
  for (const lab::PreparedPart& part : parts) {
    std::map<std::string, std::string> files;  // a suite may have several views of a scene
    for (const lab::SceneEntry& scene : part.missing) files[scene.file] = scene.credit;
    for (const auto& [file, credit] : files) {
      all[file].credit = credit;
      all[file].parts.push_back(part.part.names[0]);
    }
    if (part.own_scenes) replaced.push_back(part.part.names[0]);
  }
  if (all.empty()) return;
  fmt::print(stderr, "{} of the paper's scenes {} missing{}:\n", all.size(), all.size() == 1 ? "is" : "are",
             folder.empty() ? " (no --scenes DIR given)" : " in '" + folder + "'");
  for (const auto& [file, missing] : all)
    fmt::print(stderr, "  {}, in {}: {}\n", file, fmt::join(missing.parts, ", "), missing.credit);
  fmt::print(stderr, "`covary scenes` says where they come from.");
  if (!replaced.empty())
    fmt::print(stderr, " Scenes of covary take their place in {}, whose numbers are not the paper's.",
               fmt::join(replaced, ", "));
  fmt::print(stderr, "\n");
}

/// Overrides as they hold for a part.
lab::Overrides overrides_of(const ExperimentCommand& command, const lab::PreparedPart& part) {
  lab::Overrides overrides = command.overrides;
  if (overrides.quick) overrides.quick = part.part.quick;
  return overrides;
}

/// Says how long each part will take, and all of them.
void print_estimates(const std::vector<lab::PreparedPart>& parts, std::vector<lab::ExperimentOptions>& options) {
  lab::TimeEstimator estimator(options[0]);
  double seconds = 0;
  std::string left_out;
  for (size_t i = 0; i < parts.size(); ++i) {
    const lab::TimeEstimate estimate = estimator.of(parts[i].suite, options[i].max_pixels);
    options[i].expected_seconds = estimate.seconds;
    const std::string finished = estimate.finished > 0 ? fmt::format(", {} made before", estimate.finished) : "";
    fmt::print(stderr, "{:14} about {:>8}, {} runs{}: {}\n", parts[i].part.names[0], format_duration(estimate.seconds),
               estimate.runs, finished, parts[i].part.title);
    seconds += estimate.seconds;
    if (left_out.empty()) left_out = estimate.left_out;
  }
  fmt::print(stderr, "{:14} about {:>8}, (h:)min:s by the speed of path tracing on cores without other work\n",
             "together", format_duration(seconds));
  if (!left_out.empty()) fmt::print(stderr, "{:14} without scenes that do not render: {}\n", "", left_out);
}

void print_suites(const std::vector<lab::PreparedPart>& parts) {
  nlohmann::ordered_json suites = nlohmann::ordered_json::array();
  for (const lab::PreparedPart& part : parts) suites.push_back(lab::to_json(part.suite));
  write_text_output("-", json_text(suites));
}

void write_paper(const lab::PaperReport& report, const std::string& folder) {
  write_text_file(folder + kResults, json_text(report.data(), 1));
  write_report(folder + kReport, report.document(), report.pictures());
}

}  // namespace

void experiment_paper(const ExperimentCommand& command, const lab::Paper& paper) {
  if (!command.programs.empty() || !command.renderers.empty())
    throw Error(ErrorCode::kUsage, "a paper has no --program or --renderer; give them to one of its suites");
  const std::string own_folder = lab::own_scenes_folder(program_path());
  const std::vector<lab::PreparedPart> parts =
      lab::prepare_parts(paper, command.only, command.scenes, own_folder, command.overrides);
  if (command.print) return print_suites(parts);
  if (command.output.empty()) throw Error(ErrorCode::kUsage, "no folder for the results given; use -o DIR");
  make_output_folder(command.output);
  std::vector<lab::ExperimentOptions> options;
  for (const lab::PreparedPart& part : parts) {
    check_methods(part.suite, {});
    const std::string folder = command.output + "/" + part.part.names[0];
    make_output_folder(folder);
    check_files(command, part.suite, own_folder, folder);
    options.push_back(run_options(command, own_folder, {}));
    options.back().max_pixels = lab::max_pixels(overrides_of(command, part));
    if (options.size() == 1)
      options[0].reader = std::make_shared<lab::SceneReader>(options[0].program, options[0].stop);
    options.back().reader = options[0].reader;
  }
  check_files(command, parts[0].suite, own_folder, command.output);
  if (!command.quiet) print_missing(parts, command.scenes), print_estimates(parts, options);

  lab::PaperReport report(paper);
  size_t n_failures = 0;
  for (size_t i = 0; i < parts.size(); ++i) {
    const std::string& name = parts[i].part.names[0];
    lab::Results results = run_suite(parts[i].suite, options[i], name + ": ", command.quiet);
    n_failures += results.failures.size();
    if (command.the_part.of > 0) continue;
    const std::string folder = command.output + "/" + name;
    Written written = write_results(std::move(results), options[i].context.program_version, folder);
    if (!command.quiet) print_summary(written.results, folder);
    report.add(parts[i], written.results, std::move(written.document), std::move(written.pictures));
    write_paper(report, command.output);
  }
  if (!command.quiet && command.the_part.of == 0)
    fmt::print(stderr, "{0}{1}, {0}{2}: all parts\n", command.output, kReport, kResults);
  throw_if_failed(n_failures, command);
}

}  // namespace covary
