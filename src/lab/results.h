// SPDX-License-Identifier: Apache-2.0
// Results of an experiment, and their two machine-readable forms, described in docs/file-formats.md.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "lab/error_split.h"
#include "lab/plan.h"
#include "lab/runner.h"
#include "lab/suite.h"
#include "metrics/sequence_errors.h"

namespace covary::lab {

/// One run of a cell.
struct RunResult {
  uint64_t seed = 0;
  RunRecord record;
  double relmse = 0, relmse_trimmed = 0, mse = 0, mae = 0, flip = 0, above5 = 0, mean_ratio = 0;
  double predicted_relmse = kNone;  ///< from the run's own standard errors, if any
  /// Bounds that the run reports for its relMSE, meant to hold in 80 % of renders; NaN if it reports none.
  double predicted_low = kNone, predicted_high = kNone;
  /// Fraction of the values within 1.96 standard errors of the reference, the reference's own noise included.
  double coverage = kNone;
  double temporal = kNone, temporal_flip = kNone;  ///< of sequences: metrics/sequence_errors.h
  std::vector<FrameErrors> frames;                 ///< empty for a single image
};

/// Numbers of samples that differ by at most this fraction count as equal.
inline constexpr double kSameSamples = 0.01;

/// All runs of one scene, method and budget.
struct Cell {
  size_t scene = 0, method = 0, budget = 0;  ///< indices into the suite
  std::vector<RunResult> runs;               ///< by seed, in the suite's order
  ErrorSplit split;
  Estimate relmse_trimmed, mae, flip, above5;
  double mae_of_mean = kNone, flip_of_mean = kNone;  ///< of the mean image of all runs
  Estimate load_seconds, render_seconds, estimate_seconds, then_seconds;
  Estimate method_seconds;     ///< render + estimate + then
  Estimate processor_seconds;  ///< of the same; 0: unknown
  /// Time of this method over that of the baseline, by the clock and by the processor; nothing is known without both.
  double clock_ratio = kNone, processor_ratio = kNone;
  double samples_per_pixel = 0, peak_memory_bytes = 0;
  Estimate efficiency;  ///< 1 / (relMSE x method seconds)
  /// Error of the baseline over the error of this method, at equal samples and at equal time.
  Estimate equal_sample, equal_time;
  Estimate equal_processor_time;  ///< with budgets in samples
  /// Numbers of samples differ by more than kSameSamples, so equal_sample compares error x samples.
  bool equal_sample_normalised = false;
  /// For time budgets: method seconds / budget.
  double time_ratio = kNone;
  Estimate predicted_over_true;  ///< predicted relMSE / relMSE
  Estimate coverage;             ///< of RunResult
  // For sequences: errors of changes between frames, and comparisons with the baseline at the same budget.
  Estimate temporal, temporal_flip;
  Estimate temporal_gain;           ///< temporal error of the baseline over that of this method
  std::vector<FrameErrors> frames;  ///< means over seeds
  std::optional<WorstRegions> worst;
  double bounded = kNone;      ///< fraction of runs with a prediction that also report bounds
  double bounds_hold = kNone;  ///< fraction of these whose relMSE is within the bounds
  double published_relmse = kNone, published_ratio = kNone;
  std::vector<std::string> suspicions;
};

struct Reference {
  std::vector<std::string> files;
  std::string origin;     ///< command lines or "given"
  uint32_t spp = 0;       ///< of each half; 0 if given
  double seconds = 0;     ///< both halves
  double relmse = kNone;  ///< of the mean of the halves
};

struct SceneResult {
  SceneInstance scene;
  Reference reference;
  /// The files of both halves, of all frames.
  std::vector<std::string> reference_files() const;
};

struct Failure {
  std::string scene, method, budget;  ///< empty if it concerns all
  std::string command, message;
  int exit_code = 0;
  size_t not_tried = 0;  ///< runs that were skipped because of it
};

struct Slope {
  size_t scene = 0, method = 0;
  Estimate exponent;
};

/// Geometric means over the scenes in which every method has usable numbers at the budget, so that rows are comparable;
/// methods that have none in any scene do not restrict the scenes.
struct Summary {
  size_t method = 0, budget = 0, n_scenes = 0;
  double samples_per_pixel = kNone;      ///< taken, mean over scenes
  bool equal_sample_normalised = false;  ///< in any scene
  Estimate equal_sample, equal_time;
  double relmse = kNone, published_ratio = kNone;  ///< the latter if all of these scenes have one
  double flip = kNone;                             ///< arithmetic mean
  std::vector<size_t> unusable;                    ///< scenes in which this method has no positive error or no ratio
};

struct Results {
  Suite suite;
  bool complete = false;  ///< nothing failed
  std::string version, command, date;
  nlohmann::ordered_json machine;
  std::vector<SceneResult> scenes;  ///< in the suite's order; a scene that could not be read has no frame
  std::vector<Cell> cells;
  std::vector<Slope> slopes;
  std::vector<Summary> summaries;
  std::vector<Failure> failures;
  std::vector<std::string> warnings;

  const Cell* find(size_t scene, size_t method, size_t budget) const;
};

/// First word of the value of "format", the first key.
inline constexpr const char* kResultsFormat = "covary-experiment";
nlohmann::ordered_json to_json(const Results& results);
/// CSV of to_json() in long format: scene, method, budget, unit, seed, quantity, value, standard_error, low, high.
std::string to_csv(const nlohmann::ordered_json& results);

/// Processor, cores, memory, operating system.
nlohmann::ordered_json machine_facts();

}  // namespace covary::lab
