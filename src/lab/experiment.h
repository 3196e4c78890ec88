// SPDX-License-Identifier: Apache-2.0
// Runs a suite: inspects scenes, makes missing references and runs, and measures everything. One failing run does not
// stop the rest.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <string>

#include "lab/results.h"
#include "lab/scene_plan.h"

namespace covary::lab {

struct Progress {
  size_t done = 0, total = 0;  ///< runs, including references
  double seconds_left = 0;     ///< 0: unknown
  std::string what;            ///< "kitchen, iicv, 192 spp, seed 3"
  enum class Kind { kStarted, kFailed } kind = Kind::kStarted;
};

/// A part of an experiment, for one of several machines: number `number`, counted from 0, of `of` parts. The units of
/// division are halves of references, and the runs of all methods for one seed and budget (number_of_parts()). of == 0:
/// the whole.
struct Part {
  size_t number = 0, of = 0;
};

struct ExperimentOptions {
  std::string program;  ///< path of `covary`
  std::string cache_folder;
  std::string scenes_folder;  ///< folder in which the suite's scene files are looked up
  PlanContext context;
  int64_t max_pixels = 0;                         ///< > 0: frames are scaled down to this many pixels
  int threads = 0;                                ///< of each render; 0: the default
  std::shared_ptr<SceneReader> reader = nullptr;  ///< to share between experiments; null: one of its own
  bool keep_passes = false;
  Part part;                                ///< makes and keeps only this part's runs, and measures nothing
  double expected_seconds = 0;              ///< TimeEstimate::seconds, told until a run has ended; 0: unknown
  const std::atomic<bool>* stop = nullptr;  ///< stops after the run in progress has saved its state
  std::function<void(const Progress&)> progress;
};

/// Throws Error(kUsage) with every problem of the suite, Error(kIo) if the cache cannot be used, Unfinished if stopped;
/// everything else is in Results::failures.
Results run_experiment(const Suite& suite, const ExperimentOptions& options);

}  // namespace covary::lab
