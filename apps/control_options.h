// SPDX-License-Identifier: Apache-2.0
// The options of --integrator controlled-path on the command line.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "integrators/control_settings.h"
#include "io/load_scene.h"

namespace covary {

/// Group of the options in the help.
inline constexpr const char* kControlGroup = "Controlled path";

/// As given; empty: not given.
struct ControlTexts {
  std::string kind, lights, grid, variance, prefix, albedo, indirect;
  std::optional<uint32_t> train_spp, clusters, memory_mib;
  bool paper = false;
  bool path_lengths = false;
};

void add_control_options(CLI::App& command, ControlTexts& texts);

/// What they say; nothing where none was given. Throws Error(kUsage).
std::optional<ControlOptions> control_options(const ControlTexts& texts);

/// Throws Error(kUsage) where options are given and the scene's integrator has none of them. `integrator`: the one that
/// took the place of the scene's, or empty.
void check_control_options(const ControlTexts& texts, const LoadedScene& scene, const std::string& integrator);

/// The options that decide on samples as words of a command line.
std::vector<std::string> command_words(const ControlTexts& texts);

}  // namespace covary
