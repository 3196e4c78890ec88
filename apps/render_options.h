// SPDX-License-Identifier: Apache-2.0
// The options of `covary render`.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <string>
#include <vector>

#include "declared_options.h"
#include "live_options.h"
#include "plans/render_settings.h"
#include "sequences/sequence_settings.h"

namespace covary {

struct RenderOptions {
  std::string scene, json, stages, replay, display_server;
  OptionValues values, of_integrator, of_estimator, of_sequence;  ///< as given
  RenderSettings settings;                                        ///< the meaning of `values`, by check_options()
  SequenceSettings sequence;                                      ///< the same of `of_sequence`
  SceneOptions scene_options;
  LiveOptions live;
  int threads = 0;
  bool quiet = false, verbose = false;

  const RenderRequest& request() const { return settings.request; }
  /// One sample or light path is printed instead of rendering.
  bool is_replay() const { return !replay.empty(); }
  bool replays_light() const { return replay.starts_with("light"); }
};

/// The file of this program.
std::string program_path();

/// The file of that name or, if there is none, the small built-in scene of that name in the program's installation or
/// source tree.
std::string scene_file(const std::string& word);
/// Their names.
std::vector<std::string> builtin_scene_names();

void add_render_options(CLI::App& command, RenderOptions& options);

/// Reads `values`, and checks everything that can be wrong before the scene is loaded: throws Error(kUsage). --sampling
/// alone means a plain render.
void check_options(RenderOptions& options);

/// The scene, with the integrator that the options choose. Throws Error.
LoadedScene load(const RenderOptions& options);

/// The request of the options, checked by check_options().
Method estimator_of(const RenderOptions& options);
Plan make_plan(const RenderOptions& options);
RenderRequest make_request(const RenderOptions& options, const LoadedScene& scene);
/// What the image is made of (plans/made_of.h); `of_frame`: what else a frame depends on.
std::string made_of(const RenderOptions& options, const LoadedScene& scene, const OptionValues& of_frame = {});
/// The number of the light path of --replay; throws Error(kUsage).
uint64_t replayed_light_path(const RenderOptions& options);
/// The sample of --replay: of each film of the plan, or only of the one that --sampling names.
std::vector<SampleAddress> replayed_samples(const RenderOptions& options);

}  // namespace covary
