// SPDX-License-Identifier: Apache-2.0
// The options of `covary render` for integrators that trace light (integrators/light_pass.h).
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "io/load_scene.h"

namespace covary {

struct LightOptions {
  std::optional<std::string> light_tracing, light_paths, heuristic;
  std::optional<uint64_t> replay;  ///< number of a light path
};

void add_light_options(CLI::App& command, LightOptions& options);

/// What the options say of the integrator, for LoadOptions::integrator_properties.
std::vector<Property> integrator_properties(const LightOptions& options);

/// The options as words of a command line, but for --replay-light.
std::vector<std::string> option_words(const LightOptions& options);

/// Throws Error(kUsage) where one of the options is given and the scene's integrator traces no light, and where
/// --light-paths is, and no light is traced in this render. `has_crn_pass`: some pass has common random numbers.
void check_light_options(const LightOptions& options, const LoadedScene& scene, const std::string& integrator,
                         bool has_crn_pass);

}  // namespace covary
