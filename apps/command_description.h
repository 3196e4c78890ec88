// SPDX-License-Identifier: Apache-2.0
// The program's commands and options as plain data, extracted from the command-line parser: the source of the man page,
// shell completions and help.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace covary {

struct OptionDescription {
  /// With dashes, short ones first; empty for a positional argument.
  std::vector<std::string> names;
  /// The placeholder of the value in the help ("UINT", "X,Y", or the name of a positional); "" for a flag.
  std::string value;
  /// All accepted values, if that is a short list.
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

/// The text after the option in the help: its choices, or its placeholder.
std::string value_text(const OptionDescription& option);

/// The options of `app` itself.
CommandDescription describe_command(const CLI::App& app);
/// The subcommands of `app`, in order.
std::vector<CommandDescription> describe_subcommands(const CLI::App& app);

/// Heading in the help for options without a group, which everybody needs.
inline constexpr const char* kBasicOptions = "Options";
/// The headings of the command's options, in the order in which they first appear.
std::vector<std::string> groups_of(const CommandDescription& command);

/// The help of a command, in lines of at most 100 columns; without `all`, only kBasicOptions.
std::string help_text(const CLI::App& app, const std::string& name, bool all);

/// A line of a help: `text` next to its term, wrapped; below it if the term is long.
std::string help_entry(const std::string& term, const std::string& text);

/// A man page (section 1), in man(7) macros.
std::string man_page(const CLI::App& app, const std::string& version);

/// Completion script for `shell`: bash, zsh or fish. Throws Error(kUsage) for any other.
std::string completion_script(const CLI::App& app, const std::string& shell);

}  // namespace covary
