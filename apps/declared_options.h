// SPDX-License-Identifier: Apache-2.0
// Command-line options declared by components (settings/settings.h).
#pragma once

#include <CLI/CLI.hpp>
#include <map>
#include <string>
#include <vector>

#include "settings/option.h"

namespace covary {

/// Adds the options to the command: values given on the command line are stored in `values`, by names without dashes,
/// and checked against the declaration. `values` must outlive the command.
void add_options(CLI::App& command, const std::vector<Option>& options, OptionValues& values);

/// Adds an option with a value; `kind` is its placeholder in the help.
template <typename T>
CLI::Option* add_value(CLI::App& command, const std::string& names, T& value, const char* kind,
                       const std::string& help) {
  return command.add_option(names, value, help)->type_name(kind);
}

/// --overwrite, for Outputs::writes_result().
void add_overwrite_option(CLI::App& command, bool& overwrite);

// -D name=value on the command line: values for the scene's <default> elements.

void add_define_option(CLI::App& command, std::vector<std::string>& defines);

/// Throws Error(kUsage) for a text that is not name=value.
std::map<std::string, std::string> parse_defines(const std::vector<std::string>& defines);

}  // namespace covary
