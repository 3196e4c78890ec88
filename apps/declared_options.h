// SPDX-License-Identifier: Apache-2.0
// Command-line options declared by components (settings/settings.h).
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "settings/option.h"

namespace covary {

struct LoadOptions;

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

/// How a scene's file is read.
struct SceneOptions {
  std::vector<std::string> defines;  ///< name=value, for the <default> elements
  bool ignore_unknown = false;
};
void add_scene_options(CLI::App& command, SceneOptions& options);
/// Throws Error(kUsage) for a define that is not name=value.
LoadOptions load_options(const SceneOptions& options);
/// The options as words of a command.
std::vector<std::string> scene_words(const SceneOptions& options);

}  // namespace covary
