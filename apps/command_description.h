// SPDX-License-Identifier: Apache-2.0
// The program's commands and options as plain data, read from the command-line parser: what the man page and the shell
// completions are made of, and the help.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace covary {

struct OptionDescription {
  /// With their dashes, short ones first; empty for a positional argument.
  std::vector<std::string> names;
  /// What follows the option, as the help names it ("UINT", "X,Y", or the name of a positional); "" for a flag.
  std::string value;
  /// All that is accepted, where that is a short list.
  std::vector<std::string> choices;
  std::string text;   ///< one sentence
  std::string group;  ///< heading in the help
  /// Whether the value may be a file or folder: text that is none of `choices`.
  bool takes_files = false;
};

struct CommandDescription {
  std::string name;  ///< "render"
  std::string text;
  std::vector<OptionDescription> options, positionals;
};

/// What stands behind the option in the help: its choices, or what its value is.
std::string value_text(const OptionDescription& option);

/// The options of `app` itself.
CommandDescription describe_command(const CLI::App& app);
/// The subcommands of `app`, in their order.
std::vector<CommandDescription> describe_subcommands(const CLI::App& app);

/// Heading in the help of the options that everybody needs, those that have no group of their own.
inline constexpr const char* kBasicOptions = "Options";
/// The headings of the command's options, in the order in which they first appear.
std::vector<std::string> groups_of(const CommandDescription& command);

/// The help of a command, in lines of at most 100 columns; without `all`, of kBasicOptions alone.
std::string help_text(const CLI::App& app, const std::string& name, bool all);

/// Page of the section 1 of the manual, in the macros of man(7).
std::string man_page(const CLI::App& app, const std::string& version);

/// Completion script for `shell`: bash, zsh or fish. Throws Error(kUsage) for another one.
std::string completion_script(const CLI::App& app, const std::string& shell);

}  // namespace covary
