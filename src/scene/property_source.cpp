// SPDX-License-Identifier: Apache-2.0
#include "scene/property_source.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "core/error.h"

namespace covary {
namespace {

bool is_number(const Option& option) {
  return option.type == Option::Type::kWhole || option.type == Option::Type::kReal;
}

bool is_boolean(const Option& option) { return option.is_switch() || option.type == Option::Type::kFlag; }

/// The required type of the property.
std::string wanted(const Option& option) {
  if (is_boolean(option)) return "a boolean";
  if (option.type == Option::Type::kWhole) return "an integer";
  return option.type == Option::Type::kReal ? "a float" : "a string";
}

/// The property's value as the option's text; nothing if it has another type. The getters mark it as used.
std::optional<std::string> text_of(Parameters& parameters, const Property& property, const Option& option) {
  const Value& value = property.value;
  const std::string& name = property.name;
  if (std::holds_alternative<bool>(value) && is_boolean(option)) return parameters.get_bool(name, false) ? "on" : "off";
  if (const int64_t* whole = std::get_if<int64_t>(&value); whole && is_number(option)) {
    parameters.get_float(name, 0);
    return fmt::format("{}", *whole);
  }
  if (const double* real = std::get_if<double>(&value); real && option.type == Option::Type::kReal) {
    parameters.get_float(name, 0);
    return fmt::format("{}", *real);
  }
  const bool takes_text = is_number(option) ? !option.choices.empty() : !is_boolean(option);
  if (std::holds_alternative<std::string>(value) && takes_text) return parameters.get_string(name, "");
  return {};
}

}  // namespace

std::optional<std::string> PropertySource::find(const Option& option) {
  const std::string name = underscored(option.name);
  std::optional<std::string> text;
  const bool has_it = parameters_.has(name);  // from now on a known name, for messages
  for (const Property& property : parameters_.object().properties) {
    if (property.name != name || !has_it) continue;
    text = text_of(parameters_, property, option);
    if (!text) parameters_.error_at(property.name, "must be " + wanted(option));
  }
  if (const auto value = of_caller_.find(option.name); value != of_caller_.end()) return value->second;
  return only_caller_ ? std::nullopt : text;
}

void PropertySource::refuse(const Option& option, const std::string& problem) {
  if (is_of_caller(option)) throw Error(ErrorCode::kUsage, fmt::format("`{}` {}", option.name, problem));
  parameters_.error_at(underscored(option.name), "is " + problem);
}

void ignore_properties(Parameters& parameters, const std::vector<Option>& options) {
  PropertySource source(parameters);
  for (const Option& option : options) source.find(option);
}

}  // namespace covary
