// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <sstream>

#include "command_description.h"

namespace covary {
namespace {

constexpr size_t kColumns = 100, kTextColumn = 27;

/// Number of characters in UTF-8 text.
size_t length(const std::string& text) {
  return static_cast<size_t>(
      std::count_if(text.begin(), text.end(), [](unsigned char c) { return (c & 0xC0u) != 0x80u; }));
}

}  // namespace

std::string help_entry(const std::string& term, const std::string& text) {
  std::string lines = "  " + term;
  size_t column = length(lines);
  const auto begin_text = [&] { lines.append(kTextColumn - column, ' '), column = kTextColumn; };
  if (column + 2 > kTextColumn) lines += '\n', column = 0;
  begin_text();
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    if (column > kTextColumn && column + 1 + length(word) > kColumns) {
      lines += '\n', column = 0;
      begin_text();
    }
    if (column > kTextColumn) lines += ' ', ++column;
    lines += word, column += length(word);
  }
  return lines + "\n";
}

namespace {

std::string option_entry(const OptionDescription& option) {
  if (option.names.empty()) return help_entry(option.value, option.text);
  const std::string value = value_text(option);
  // Aligns long names of options without a short name with the others.
  const std::string indent = option.names[0].starts_with("--") ? "    " : "";
  return help_entry(fmt::format("{}{}{}{}", indent, fmt::join(option.names, ", "), value.empty() ? "" : " ", value),
                    option.text);
}

std::string section(const std::string& heading, const std::vector<OptionDescription>& options,
                    const std::string& group) {
  std::string text;
  for (const OptionDescription& option : options)
    if (option.group == group || option.names.empty()) text += option_entry(option);
  return text.empty() ? "" : "\n" + heading + ":\n" + text;
}

std::string usage_lines(const CLI::App& app, const CommandDescription& command, const std::string& name) {
  std::string text = "Usage: " + name + " [OPTIONS]";
  for (const CLI::Option* option : app.get_options([](const CLI::Option* o) { return o->get_positional(); })) {
    const std::string argument = option->get_name(true) + (option->get_items_expected_max() > 1 ? "..." : "");
    text += option->get_required() ? " " + argument : " [" + argument + "]";
  }
  return text + (command.positionals.empty() && !app.get_subcommands(nullptr).empty() ? " COMMAND\n" : "\n");
}

std::string list_of_commands(const CLI::App& app) {
  const std::vector<const CLI::App*> commands = app.get_subcommands(nullptr);
  std::vector<std::string> headings;
  for (const CLI::App* command : commands)
    if (std::find(headings.begin(), headings.end(), command->get_group()) == headings.end())
      headings.push_back(command->get_group());
  std::string text;
  for (const std::string& heading : headings) {
    text += "\n" + heading + ":\n";
    for (const CLI::App* command : commands)
      if (command->get_group() == heading) text += help_entry(command->get_name(), command->get_description());
  }
  return text;
}

}  // namespace

std::string help_text(const CLI::App& app, const std::string& name, bool all) {
  const CommandDescription command = describe_command(app);
  std::string text = command.text + "\n" + usage_lines(app, command, name);
  text += section("Arguments", command.positionals, "");
  text += section(kBasicOptions, command.options, kBasicOptions);
  std::vector<std::string> others = groups_of(command);
  std::erase(others, kBasicOptions);
  if (all) {
    for (const std::string& group : others) text += section(group, command.options, group);
  } else if (!others.empty()) {
    const auto hidden = std::count_if(command.options.begin(), command.options.end(),
                                      [](const OptionDescription& o) { return o.group != kBasicOptions; });
    text += fmt::format("\n{} more options, whose defaults suit most purposes: {} --help-all\n", hidden, name);
  }
  text += list_of_commands(app);
  if (all)
    for (const CLI::App* inner : app.get_subcommands(nullptr))
      text += "\n" + help_text(*inner, name + " " + inner->get_name(), true);
  return text;
}

}  // namespace covary
