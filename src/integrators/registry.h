// SPDX-License-Identifier: Apache-2.0
// The integrators by name, and their options.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "integrators/path_lengths.h"
#include "passes/integrator.h"

namespace covary {

/// One integrator. `make` declares its own settings.
struct IntegratorPlugin {
  const char* name;
  std::shared_ptr<Integrator> (*make)(Settings& settings, const PathLengthSettings& lengths);
};
/// All integrators, sorted by name.
std::span<const IntegratorPlugin> integrator_plugins();
/// The one of that name, or null.
const IntegratorPlugin* find_integrator(std::string_view name);
/// The settings of paths and of the integrator. `name` must be registered.
std::vector<Option> options_of_integrator(const std::string& name);
/// Those of all integrators; equal names are one option.
std::vector<Option> options_of_integrators();
std::vector<std::string> integrator_names();
/// Names of the integrators with this option, given without dashes; empty if there is none.
std::vector<std::string> integrators_with_option(const std::string& option);
/// Declares the settings of paths and of the integrator, and constructs it.
std::shared_ptr<Integrator> make_integrator(const IntegratorPlugin& plugin, Settings& settings);

}  // namespace covary
