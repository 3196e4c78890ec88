// SPDX-License-Identifier: Apache-2.0
// How long an experiment will take, before it starts.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "lab/experiment.h"

namespace covary::lab {

struct TimeEstimate {
  size_t runs = 0, finished = 0;  ///< references included; finished: in the cache
  double seconds = 0;             ///< of those that are not finished
  std::string left_out;           ///< a scene that could not be read or rendered, with the reason; such do not count
};

/// Renders a few pixels of each scene with few samples, with more of them where so few are refused, as by integrators
/// that train, once for all suites, and multiplies their processor time, as on
/// a machine without other work. Assumes that a method takes the time of plain path tracing with the same samples, and
/// that methods that share passes render them once: bidirectional paths, training and estimators take longer.
class TimeEstimator {
 public:
  explicit TimeEstimator(const ExperimentOptions& options);
  /// max_pixels: as in ExperimentOptions. min_work: with fewer samples in all that are not finished, nothing is
  /// rendered, and only time budgets count. Throws what run_experiment() throws. The cache must not be in use.
  TimeEstimate of(const Suite& suite, int64_t max_pixels, double min_work = 0);

 private:
  struct Speed {
    double seconds_per_sample = 0, seconds_per_run = 0;
  };
  struct Trial {
    std::optional<Speed> speed;
    std::string failure;
  };
  static double seconds_of(const Suite& suite, const std::vector<const Run*>& runs, const Speed& speed);
  const Trial& trial_of(const Suite& suite, const SceneInstance& scene, const Runner& runner);
  Trial try_out(const Suite& suite, const SceneInstance& scene, uint32_t spp, const Runner& runner) const;

  ExperimentOptions options_;
  std::map<std::string, Trial> trials_;  // by key of the trial without its pixels
};

}  // namespace covary::lab
