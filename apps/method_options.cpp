// SPDX-License-Identifier: Apache-2.0
#include "method_options.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <utility>

#include "combine/registry.h"
#include "command_description.h"
#include "core/error.h"
#include "declared_options.h"
#include "integrators/registry.h"
#include "settings/option_names.h"

namespace covary {
namespace {

constexpr const char* kMethods = "Methods";  ///< heading in the help

bool is_integrator(const std::string& name) { return find_integrator(name) != nullptr; }

bool is_estimator(const std::string& name) {
  const std::vector<std::string> names = estimator_names();
  return std::find(names.begin(), names.end(), name) != names.end();
}

/// The parameters of all methods; integrators and estimators share no names.
const std::vector<Option>& parameters() {
  static const std::vector<Option> all = [] {
    std::vector<Option> list = options_of_integrators();
    const std::vector<Option> of_estimators = options_of_estimators(estimator_names());
    list.insert(list.end(), of_estimators.begin(), of_estimators.end());
    std::erase_if(list, [](const Option& option) { return !is_parameter(option); });
    return list;
  }();
  return all;
}

/// Stores the value of "cv-grid=64", or of "cv_grid=64" as in scene files.
void set_parameter(const std::vector<MethodOptions>& methods, const std::string& text) {
  const size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0)
    throw CLI::ValidationError("--set", fmt::format("'{}': expected NAME=VALUE, e.g. k=50", text));
  const std::string name = dashed(text.substr(0, equals)), value = text.substr(equals + 1);
  std::vector<std::string> names;
  for (const MethodOptions& method : methods)
    for (const Option& option : method.options) {
      if (!is_parameter(option)) continue;
      names.push_back(option.name);
      if (option.name != name) continue;
      const std::optional<std::string> good = accepted(option, value);
      if (!good) throw CLI::ValidationError("--set " + name, problem_of(option, value));
      (*method.values)[name] = *good;
      return;
    }
  throw CLI::ValidationError("--set", fmt::format("no method has a parameter '{}'; expected {}{}", name,
                                                  fmt::join(names, ", "), did_you_mean(name, names)));
}

/// What is accepted as the parameter's value, as in the help of options.
std::string values_of(const Option& option) {
  if (option.type == Option::Type::kChoice) return fmt::format("{}", fmt::join(option.choices, "|"));
  const char* kind = option.type == Option::Type::kWhole ? "INT" : "FLOAT";
  return fmt::format("{}{}{}", fmt::join(option.choices, "|"), option.choices.empty() ? "" : "|", kind);
}

}  // namespace

void add_method_options(CLI::App& command, const std::vector<MethodOptions>& methods) {
  for (const MethodOptions& method : methods) {
    std::vector<Option> own = method.options;
    std::erase_if(own, is_parameter);
    for (Option& option : own) option.group = kMethods;
    add_options(command, own, *method.values);
  }
  const auto set = [methods](const std::vector<std::string>& texts) {
    for (const std::string& text : texts) set_parameter(methods, text);
  };
  command
      .add_option_function<std::vector<std::string>>(
          "--set", set, "A parameter of a method, e.g. k=50; 'covary help METHOD' lists those of one")
      ->type_name("NAME=VALUE")
      ->expected(1)
      ->take_all()
      ->allow_extra_args(false)
      ->group(kMethods);
}

std::string as_options(const std::string& text) { return as_flags(text, parameters()); }

std::string help_of_method(const std::string& name) {
  if (!is_integrator(name) && !is_estimator(name)) return "";
  std::vector<Option> own = is_integrator(name) ? options_of_integrator(name) : options_of_estimator(name);
  std::erase_if(own, [](const Option& option) { return option.level == OptionLevel::kScene; });
  std::string flags, others;
  for (const Option& option : own) {
    const std::string text = as_options(help_with_default(option));
    const std::string value = option.type == Option::Type::kFlag ? "" : values_of(option);
    if (is_parameter(option))
      others += help_entry(option.name + "=" + value, text);
    else
      flags += help_entry("--" + option.name + (value.empty() ? "" : " " + value), text);
  }
  return fmt::format("covary render SCENE -o OUT.exr --{} {}\n{}{}", is_integrator(name) ? "integrator" : "estimator",
                     name, flags.empty() ? "" : "\nOptions:\n" + flags,
                     others.empty() ? "" : "\nParameters (--set NAME=VALUE):\n" + others);
}

std::string present_form(std::string_view name, const CLI::App& command) {
  if (find_option(parameters(), name)) return fmt::format("--set {}=VALUE", name);
  // What other programs call it.
  static constexpr std::pair<std::string_view, const char*> kElsewhere[] = {
      {"bounces", "--max-depth"}, {"depth", "--max-depth"}, {"envmap", "--environment"},
      {"height", "--resolution"}, {"out", "--output"},      {"samples", "--spp"},
      {"sensor", "--camera"},     {"size", "--resolution"}, {"width", "--resolution"}};
  for (const auto& [word, option] : kElsewhere)
    if (const CLI::Option* known = name == word ? command.get_option_no_throw(option) : nullptr)
      return fmt::format("{} {}", option, known->get_type_name());
  static constexpr std::pair<std::string_view, const char*> kFormer[] = {
      {"asymmetric", "--set penalty=asymmetric"},
      {"cv-surrogate", "--set cv-variance=relative-oidn"},
      {"light-groups", "--layers light-groups"},
      {"live-port", "--live=PORT"},
      {"path-lengths", "--layers path-lengths"},
      {"pt", "--independent"},
      {"relative-error", "--until relative=X"},
      {"replay-light", "--replay light,N"},
      {"save-passes", "--passes"}};
  for (const auto& [former, present] : kFormer)
    if (name == former) return present;
  return "";
}

}  // namespace covary
