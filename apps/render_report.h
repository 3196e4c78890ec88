// SPDX-License-Identifier: Apache-2.0
// What is said of a render: statistics, the summary, samples that could not be used.
#pragma once

#include <nlohmann/json.hpp>

#include "plans/render.h"
#include "render_options.h"

namespace covary {

/// What is reported of.
struct RenderReport {
  const RenderOptions& options;
  const LoadedScene& scene;
  const RenderResult& result;
  double load_seconds = 0;  ///< of reading the scene, without building the ray tracer's hierarchy
  int threads = 0;
};

/// The object of --json.
nlohmann::ordered_json statistics(const RenderReport& report);

/// Lines on stderr about samples that were not finite or negative, with the commands that repeat them.
void report_bad_samples(const RenderOptions& options, const Pass& pass);

/// Lines on stderr about a finished render.
void print_summary(const RenderReport& report);

}  // namespace covary
