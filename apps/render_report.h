// SPDX-License-Identifier: Apache-2.0
// What is said of a render: statistics, the summary, samples that could not be used.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "estimators/grouped_image.h"
#include "render_passes.h"

namespace covary {

/// What has become of the plan.
struct Outcome {
  std::vector<Pass> passes;
  EstimatorResult image;
  std::optional<double> predicted_relmse;
  double load_seconds = 0, estimate_seconds = 0, write_seconds = 0;  ///< estimate: after the passes
  double trial_seconds = 0;   ///< of finding out, for --time, how fast passes and estimator are
  double budget_seconds = 0;  ///< of what --time limits, in this call

  template <typename F>
  double sum(F value) const {
    double total = 0;
    for (const Pass& pass : passes) total += static_cast<double>(value(pass));
    return total;
  }
  double samples_per_pixel() const {
    return sum([](const Pass& p) { return p.film.mean_count(); });
  }
  /// Time of the passes, without what estimates inside them took.
  double render_seconds() const {
    return sum([](const Pass& p) { return p.result.seconds - p.result.estimate_seconds; });
  }
  /// Time of making the image, inside the passes and of them.
  double all_estimate_seconds() const {
    return estimate_seconds + sum([](const Pass& p) { return p.result.estimate_seconds; });
  }
  bool complete() const {
    return std::all_of(passes.begin(), passes.end(), [](const Pass& p) { return p.count >= p.settings.spp; });
  }
};

/// The object of --json.
nlohmann::ordered_json statistics(const RenderOptions& options, const LoadedScene& scene, const Outcome& outcome,
                                  int threads);

/// Lines on stderr about samples that were not finite or negative, with the commands that repeat them.
void report_bad_samples(const RenderOptions& options, const Pass& pass);

/// Lines on stderr about a finished render.
void print_summary(const RenderOptions& options, const LoadedScene& scene, const Outcome& outcome);

}  // namespace covary
