// SPDX-License-Identifier: Apache-2.0
// The options of --integrator guided-path on the command line.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "integrators/guide_settings.h"
#include "io/load_scene.h"

namespace covary {

/// Group of the options in the help.
inline constexpr const char* kGuideGroup = "Guided path";

/// As given; empty: not given.
struct GuideTexts {
  std::optional<uint32_t> lobes, leaf_samples, train_spp;
  std::string fraction, nee;
};

void add_guide_options(CLI::App& command, GuideTexts& texts);

/// What they say; nothing where none was given. Throws Error(kUsage).
std::optional<GuideOptions> guide_options(const GuideTexts& texts);

/// Throws Error(kUsage) where any was given and the scene, loaded with the --integrator of that name or none, has
/// another integrator than guided-path.
void check_guide_options(const GuideTexts& texts, const LoadedScene& scene, const std::string& integrator);

/// Adds a warning to a scene whose lights at a point or in one direction the integrator cannot see.
void warn_of_unseen_lights(LoadedScene& scene);

/// The options as words of a command line.
std::vector<std::string> command_words(const GuideTexts& texts);

}  // namespace covary
