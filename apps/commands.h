// SPDX-License-Identifier: Apache-2.0
// The subcommands of `covary`. Each function adds one subcommand whose callback does the work and throws covary::Error;
// main.cpp turns errors into a message and an exit code. A new subcommand is one file, one line here, one in main.cpp.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "core/error.h"

namespace covary {

void add_render(CLI::App& app);
void add_compare(CLI::App& app);
void add_merge(CLI::App& app);
void add_info(CLI::App& app);
void add_probe(CLI::App& app);
void add_convert(CLI::App& app);
void add_convert_scene(CLI::App& app);
void add_combine(CLI::App& app);
void add_denoise(CLI::App& app);
void add_experiment(CLI::App& app);
void add_view(CLI::App& app);
void add_scenes(CLI::App& app);
void add_help(CLI::App& app);
/// Adds all subcommands, and the program's help.
void add_commands(CLI::App& app);

/// Exit code if a target error was not reached.
inline constexpr int kTargetMissed = 3;

/// The command line as given, quoted where a shell needs it; for the `command` attribute of films.
const std::string& command_line();

}  // namespace covary
