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
void add_convert(CLI::App& app);
void add_combine(CLI::App& app);
void add_denoise(CLI::App& app);
void add_experiment(CLI::App& app);
void add_view(CLI::App& app);
void add_help(CLI::App& app);

/// Work that ended before it was as wanted; what there is was written. Exit codes: 3 for a wanted error that was not
/// reached, after a signal 128 + its number, as shells have it (130 for Ctrl-C).
class Unfinished : public Error {
 public:
  Unfinished(int exit_code, const std::string& message) : Error(ErrorCode::kIo, message), exit_code_(exit_code) {}
  int exit_code() const { return exit_code_; }

 private:
  int exit_code_;
};
inline constexpr int kTargetMissed = 3;

/// The command line as given, with quotes where a shell needs them; for the `command` attribute of films.
const std::string& command_line();

}  // namespace covary
