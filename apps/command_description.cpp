// SPDX-License-Identifier: Apache-2.0
#include "command_description.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "value_names.h"

namespace covary {
namespace {

std::vector<std::string> split(const std::string& text, char separator) {
  std::vector<std::string> parts;
  size_t at = 0;
  for (size_t next; (next = text.find(separator, at)) != std::string::npos; at = next + 1)
    parts.push_back(text.substr(at, next - at));
  parts.push_back(text.substr(at));
  return parts;
}

std::string names_of(const std::set<CLI::Option*>& options) {
  std::vector<std::string> names;
  for (const CLI::Option* option : options) names.push_back(option->get_name());
  std::sort(names.begin(), names.end());
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

/// The description, followed by the default, "(required)" and the options that this one needs or excludes.
std::string text_of(const CLI::Option& option) {
  std::string text = option.get_description();
  if (option.get_items_expected_max() > 0 && !option.get_default_str().empty())
    text += "; default " + option.get_default_str();
  if (option.get_required() && !option.get_positional()) text += " (required)";
  if (!option.get_needs().empty()) text += "; with " + names_of(option.get_needs());
  if (!option.get_excludes().empty()) text += "; not with " + names_of(option.get_excludes());
  return text;
}

OptionDescription describe_option(const CLI::Option& option) {
  OptionDescription result;
  for (const std::string& name : option.get_snames()) result.names.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) result.names.push_back("--" + name);
  result.text = text_of(option);
  result.group = option.get_group();
  if (option.get_items_expected_max() == 0) return result;
  // CLI11 writes the type first, then what its validators say: "TEXT:{a,b}".
  const std::string type = option.get_type_name();
  const size_t open = type.find('{'), close = type.find('}');
  result.value = option.get_positional() ? option.get_name(true) : type.find(":{") == std::string::npos ? type : "TEXT";
  if (open != std::string::npos && close != std::string::npos)
    result.choices = split(type.substr(open + 1, close - open - 1), ',');
  else if (type.find('|') != std::string::npos)
    result.choices = split(type, '|');
  // Of "off|LIBRARY", lower-case words are choices, the others placeholders.
  const auto is_path = [](const std::string& name) {
    return name == kFileValue || name == "[FILE]" || name == kFolderValue || name == kLibraryValue || name == "TEXT";
  };
  const size_t n_choices = result.choices.size();
  std::erase_if(result.choices, is_path);
  result.takes_files = n_choices > result.choices.size() || (n_choices == 0 && is_path(type));
  return result;
}

}  // namespace

std::string value_text(const OptionDescription& option) {
  // "off|LIBRARY" does not list all choices.
  const bool are_all = !option.choices.empty() && !option.takes_files;
  return are_all ? fmt::format("{}", fmt::join(option.choices, "|")) : option.value;
}

CommandDescription describe_command(const CLI::App& app) {
  CommandDescription result;
  result.name = app.get_name();
  result.text = app.get_description();
  for (const CLI::Option* option : app.get_options())
    if (option->get_positional() || !option->get_group().empty())  // the others are hidden
      (option->get_positional() ? result.positionals : result.options).push_back(describe_option(*option));
  return result;
}

std::vector<std::string> groups_of(const CommandDescription& command) {
  std::vector<std::string> groups;
  for (const OptionDescription& option : command.options)
    if (!option.group.empty() && std::find(groups.begin(), groups.end(), option.group) == groups.end())
      groups.push_back(option.group);
  return groups;
}

std::vector<CommandDescription> describe_subcommands(const CLI::App& app) {
  std::vector<CommandDescription> result;
  for (const CLI::App* command : app.get_subcommands(nullptr)) result.push_back(describe_command(*command));
  return result;
}

}  // namespace covary
