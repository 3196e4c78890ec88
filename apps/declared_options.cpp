// SPDX-License-Identifier: Apache-2.0
#include "declared_options.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "command_description.h"
#include "core/error.h"
#include "io/load_scene.h"
#include "method_options.h"
#include "value_names.h"

namespace covary {
namespace {

constexpr int kMaxTexts = 1000;  ///< upper bound on values of a repeatable option

/// "--cv-grid", "-o,--output".
std::string names_of(const Option& option) {
  return (option.letter.empty() ? "" : "-" + option.letter + ",") + "--" + option.name;
}

/// What the help shows after the name.
std::string value_name(const Option& option) {
  if (option.type == Option::Type::kChoice) return fmt::format("{{{}}}", fmt::join(option.choices, ","));
  // A text that may also be a keyword: "off|LIBRARY".
  if (const char* named = value_name_of(option.names))
    return option.form.ends_with(std::string("|") + named) ? option.form : named;
  if (option.type == Option::Type::kText) return option.form;
  return (option.choices.empty() ? "" : option.choices[0] + "|") +
         (option.type == Option::Type::kWhole ? "INT" : "FLOAT");
}

CLI::Validator checked(const Option& option) {
  const auto check = [option](std::string& text) -> std::string {
    const std::optional<std::string> value = accepted(option, text);
    if (!value) return problem_of(option, text);
    text = *value;
    return "";
  };
  return {check, "", "value"};
}

void add_option(CLI::App& command, const Option& what, OptionValues& values) {
  const std::string names = names_of(what), help = as_options(help_with_default(what));
  CLI::Option* option = nullptr;
  if (what.type == Option::Type::kFlag) {
    option = command.add_flag_callback(
        names, [&values, name = what.name] { values[name] = ""; }, help);
  } else if (what.repeats) {
    option = command.add_option_function<std::vector<std::string>>(
        names,
        [&values, name = what.name](const std::vector<std::string>& texts) {
          values[name] = fmt::format("{}", fmt::join(texts, "\n"));
        },
        help);
  } else {
    option = command.add_option_function<std::string>(
        names, [&values, name = what.name](const std::string& text) { values[name] = text; }, help);
    option->transform(checked(what));
  }
  if (what.type != Option::Type::kFlag) option->type_name(value_name(what));
  if (what.repeats) option->expected(1, kMaxTexts)->take_all();
  const bool is_basic = what.level == OptionLevel::kBasic || what.group.empty();
  option->group(is_basic ? kBasicOptions : what.group);
}

}  // namespace

void add_options(CLI::App& command, const std::vector<Option>& options, OptionValues& values) {
  for (const Option& option : options) add_option(command, option, values);
}

void add_overwrite_option(CLI::App& command, bool& overwrite) {
  command.add_flag("--overwrite", overwrite, "Replace the output even if another command or program made it");
}

void add_scene_options(CLI::App& command, SceneOptions& options) {
  add_value(command, "-D,--define", options.defines, "name=value", "Value of one of the scene's <default> elements")
      ->take_all()
      ->expected(1)
      ->allow_extra_args(false);
  command.add_flag("--ignore-unknown", options.ignore_unknown,
                   "Warn of unknown plugins and parameters; unknown BSDFs become grey");
}

LoadOptions load_options(const SceneOptions& options) {
  LoadOptions result;
  for (const std::string& define : options.defines) {
    const size_t equals = define.find('=');
    if (equals == 0 || equals == std::string::npos)
      throw Error(ErrorCode::kUsage, "-D '" + define + "': expected name=value");
    result.defines[define.substr(0, equals)] = define.substr(equals + 1);
  }
  result.ignore_unknown = options.ignore_unknown;
  return result;
}

std::vector<std::string> scene_words(const SceneOptions& options) {
  std::vector<std::string> words;
  for (const std::string& define : options.defines) words.insert(words.end(), {"-D", define});
  if (options.ignore_unknown) words.emplace_back("--ignore-unknown");
  return words;
}

}  // namespace covary
