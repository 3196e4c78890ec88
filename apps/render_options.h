// SPDX-License-Identifier: Apache-2.0
// The options of `covary render`.
#pragma once

#include <CLI/CLI.hpp>
#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "estimator_options.h"
#include "plans/plan.h"
#include "plans/render.h"

namespace covary {

struct RenderOptions {
  std::string scene, output, integrator, sampling, split = "1:1", rfilter, json, passes;
  std::string stages, resolution, crop, replay, until, display_server, save_training, load_training;
  std::string crn_part = "both", sampler, debug_strategies;
  EstimatorOptions estimator;
  OptionValues of_integrator;  ///< options of integrators, of depths as well
  std::vector<std::string> defines;
  std::optional<uint32_t> spp;
  std::optional<int> groups;
  std::optional<uint64_t> replay_light;  ///< number of a light path
  uint64_t seed = 0;
  int threads = 0;
  double seconds = 0, checkpoint_seconds = 300;
  /// One sample or light path is printed instead of rendering.
  bool is_replay() const { return !replay.empty() || replay_light; }
  bool path_lengths = false;
  bool resume = false, overwrite = false, aovs = false, quiet = false, preview = true;
};

void add_render_options(CLI::App& command, RenderOptions& options);

/// Everything that can be wrong before the scene is loaded, as Error(kUsage); and --sampling alone means a plain
/// render.
void check_options(RenderOptions& options);

/// The scene, with the integrator that the options choose. Throws Error.
LoadedScene load(const RenderOptions& options);

/// What the options ask for, checked by check_options(). Throws Error(kUsage) for a --crop outside the frame.
Plan make_plan(const RenderOptions& options);
RenderRequest make_request(const RenderOptions& options, const LoadedScene& scene);
/// The sample that --replay names.
SampleAddress replayed_sample(const RenderOptions& options);

/// --split "1:3": parts of the samples for the CRN and the independent pass; they add up to 1.
std::array<double, 2> parse_split(const std::string& text);
/// --until "relmse=0.005" or "relmse-p95=0.01".
struct Until {
  double error = 0;
  bool in_blocks = false;  ///< of 16 x 16 pixels, 95 % of which are to have less
};
Until parse_until(const std::string& text);

}  // namespace covary
