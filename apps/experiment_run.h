// SPDX-License-Identifier: Apache-2.0
// Steps of `covary experiment`, of a suite and of the parts of a paper.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "lab/experiment.h"
#include "lab/overrides.h"
#include "papers/paper.h"
#include "report/report.h"

namespace covary {

struct ExperimentCommand {
  std::string suite, output, cache, scenes;
  std::string seeds, part;
  std::vector<std::string> only;  ///< parts of a paper
  std::vector<uint32_t> spp;
  std::vector<double> seconds;
  std::vector<std::string> programs, renderers;
  lab::Overrides overrides;
  int threads = 0;
  lab::Part the_part;  ///< `part`, read
  bool quick = false;
  bool list = false, print = false, keep_passes = false, quiet = false;
};

constexpr const char *kResults = "/results.json", *kTable = "/results.csv", *kReport = "/report.html";

/// The text of a file. Throws Error(kIo).
std::string read_file(const std::string& path);

/// Makes the folder of the results. Throws Error.

/// Throws Error(kIo) if the folder has none of the scenes of a built-in suite.
void check_scenes(const lab::Suite& suite, const std::string& name, const std::string& folder);

/// Before the experiment begins: results in `folder` must not overwrite anything that it reads, or unrelated files.
void check_files(const ExperimentCommand& command, const lab::Suite& suite, const std::string& scenes,
                 const std::string& folder);

/// Checks that all programs are given, and parses each method's options as `covary render` will, so that nothing runs
/// unless all are valid. run_experiment() reports other mistakes of the suite.
void check_methods(const lab::Suite& suite, const lab::Programs& programs);

/// What the command says about running a suite.
lab::ExperimentOptions run_options(const ExperimentCommand& command, const std::string& scenes,
                                   const lab::Programs& programs);

/// Says how long a suite will take, if that is minutes, and keeps it as the expected time.
void tell_time(const lab::Suite& suite, lab::ExperimentOptions& options);

/// Runs a suite, showing progress after `name`.
lab::Results run_suite(const lab::Suite& suite, lab::ExperimentOptions options, const std::string& name, bool quiet);

/// Results with what identifies them, written to a folder as results.json, results.csv and report.html.
struct Written {
  lab::Results results;
  nlohmann::ordered_json document;
  std::vector<ReportImage> pictures;
};
Written write_results(lab::Results results, const std::string& version, const std::string& folder);

void print_summary(const lab::Results& results, const std::string& folder);

/// Throws Error(kInput) if something failed.
void throw_if_failed(size_t n_failures, const ExperimentCommand& command);

/// `covary experiment NAME` for a paper.
void experiment_paper(const ExperimentCommand& command, const lab::Paper& paper);

}  // namespace covary
