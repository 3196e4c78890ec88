// SPDX-License-Identifier: Apache-2.0
// Options of methods (integrators and estimators) on the command line. Flags, and what everybody needs, are options of
// the command; all other parameters share one option: --set cv-grid=64. So a method's parameters lengthen no help.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "settings/option.h"

namespace covary {

/// Declared options and where their values go.
struct MethodOptions {
  std::vector<Option> options;
  OptionValues* values = nullptr;
};

/// Adds the flags and basic options of the methods, and --set for all others. `values` must outlive the command.
void add_method_options(CLI::App& command, const std::vector<MethodOptions>& methods);

/// The library's names in backquotes as a command line has them: "--spp", "--set cv=off" for "`cv` off".
std::string as_options(const std::string& text);

/// The options and parameters of an integrator or estimator, as `covary help NAME` prints them; "" if there is none of
/// that name.
std::string help_of_method(const std::string& name);

/// What to write instead of the option `name`, given without dashes, of earlier versions or of other programs, e.g.
/// "--set cv-grid=VALUE" or "--spp INT"; "" if none is known that `command` has.
std::string present_form(std::string_view name, const CLI::App& command);

}  // namespace covary
