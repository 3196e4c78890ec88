// SPDX-License-Identifier: Apache-2.0
#include "command_description.h"

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

OptionDescription describe_option(const CLI::Option& option) {
  OptionDescription result;
  for (const std::string& name : option.get_snames()) result.names.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) result.names.push_back("--" + name);
  result.text = option.get_description();
  result.group = option.get_group();
  if (option.get_items_expected_max() == 0) return result;
  // The parser writes the type first, then what its checks say: "TEXT:{a,b}", "UINT:UINT in [1 - 4]".
  const std::string type = option.get_type_name();
  const size_t open = type.find('{'), close = type.find('}');
  result.value = option.get_positional() ? option.get_name(true) : type.substr(0, type.find(':'));
  if (open != std::string::npos && close != std::string::npos)
    result.choices = split(type.substr(open + 1, close - open - 1), ',');
  else if (type.find('|') != std::string::npos)
    result.choices = split(type, '|');
  result.takes_files = result.choices.empty() && (type.starts_with("TEXT") || type.find("FILE") != std::string::npos);
  return result;
}

}  // namespace

CommandDescription describe_command(const CLI::App& app) {
  CommandDescription result;
  result.name = app.get_name();
  result.text = app.get_description();
  for (const CLI::Option* option : app.get_options())
    (option->get_positional() ? result.positionals : result.options).push_back(describe_option(*option));
  return result;
}

std::vector<CommandDescription> describe_subcommands(const CLI::App& app) {
  std::vector<CommandDescription> result;
  for (const CLI::App* command : app.get_subcommands(nullptr)) result.push_back(describe_command(*command));
  return result;
}

}  // namespace covary
