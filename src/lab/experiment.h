// SPDX-License-Identifier: Apache-2.0
// Runs a suite: scenes are looked at, references and runs made where the cache lacks them, and everything is measured.
// One failing run does not stop the rest.
#pragma once

#include <atomic>
#include <functional>
#include <string>

#include "lab/results.h"

namespace covary::lab {

struct Progress {
  size_t done = 0, total = 0;  ///< runs, references included
  double seconds_left = 0;     ///< 0: unknown
  std::string what;            ///< "kitchen, iicv, 192 spp, seed 3"
  enum class Kind { kStarted, kFailed } kind = Kind::kStarted;
};

/// A part of an experiment that machines make side by side: number `number`, from 0, of `of` parts. What is divided
/// are the halves of references, and for each seed and budget the runs of all methods (number_of_parts()).
/// of == 0: the whole.
struct Part {
  size_t number = 0, of = 0;
};

struct ExperimentOptions {
  std::string program;  ///< path of `covary`
  std::string cache_folder;
  std::string scenes_folder;  ///< where the suite's scene files are looked up
  PlanContext context;
  int64_t max_pixels = 0;  ///< > 0: frames are scaled down to so many pixels
  int threads = 0;         ///< of each render; 0: its default
  bool keep_passes = false;
  Part part;                                ///< only its runs are made and kept, and nothing is measured
  const std::atomic<bool>* stop = nullptr;  ///< ends after the run in progress has saved its state
  std::function<void(const Progress&)> progress;
};

/// Throws Error(kUsage) with every problem of the suite, Error(kIo) where the cache cannot be used, Unfinished when
/// stopped; all else is in Results::failures.
Results run_experiment(const Suite& suite, const ExperimentOptions& options);

}  // namespace covary::lab
