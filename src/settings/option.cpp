// SPDX-License-Identifier: Apache-2.0
#include "settings/option.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/number_text.h"

namespace covary {
namespace {

std::optional<std::string> accepted_whole(const Option& option, const std::string& text) {
  if (const std::optional<uint64_t> value = parse_number<uint64_t>(text)) {
    const bool good = *value <= option.most && option.range.contains(static_cast<double>(*value));
    return good ? std::optional(std::to_string(*value)) : std::nullopt;
  }
  const std::optional<int64_t> value = parse_number<int64_t>(text);
  const bool good = value && *value >= option.least && option.range.contains(static_cast<double>(*value));
  return good ? std::optional(std::to_string(*value)) : std::nullopt;
}

std::optional<std::string> accepted_real(const Option& option, const std::string& text) {
  const std::optional<double> value = parse_number<double>(text);
  if (!value || !std::isfinite(static_cast<float>(*value)) || !option.range.contains(*value)) return {};
  return std::string(without_plus(text));
}

bool is_number(const Option& option) {
  return option.type == Option::Type::kWhole || option.type == Option::Type::kReal;
}

bool is_one_of(const std::vector<std::string>& names, const std::string& text) {
  return std::find(names.begin(), names.end(), text) != names.end();
}

/// "auto or " if the number can also be the word "auto".
std::string words_before(const Option& option) {
  std::string words;
  for (const std::string& word : option.choices) words += word + " or ";
  return words;
}

}  // namespace

bool OptionRange::contains(double value) const {
  return (above_low ? value > low : value >= low) && (below_high ? value < high : value <= high) &&
         (!odd || std::abs(std::remainder(value, 2)) == 1);
}

std::string OptionRange::text() const {
  std::string bounds;
  if (std::isfinite(low) && std::isfinite(high))
    bounds = fmt::format("{}{} {} {}", above_low ? "above " : "", low, below_high ? "and below" : "to", high);
  else if (std::isfinite(low))
    bounds = fmt::format("{} {}", above_low ? "above" : "at least", low);
  return odd ? "odd, " + bounds : bounds;
}

bool Option::is_switch() const { return type == Type::kChoice && choices == std::vector<std::string>{"on", "off"}; }

std::string Option::expected() const {
  if (type == Type::kFlag) return "no value";
  if (type == Type::kText) return form;
  if (type == Type::kChoice) return fmt::format("{}", fmt::join(choices, ", "));
  const char* kind = type == Type::kWhole ? "whole number" : "number";
  std::string bounds = range.text();
  const bool is_bare = bounds.empty() || bounds[0] < '0' || bounds[0] > '9';
  if (range.odd) bounds = bounds.substr(bounds.find(' ') + 1);
  const char* link = bounds.empty()                ? ""
                     : bounds.starts_with("above") ? " "
                     : is_bare && !range.odd       ? " of "
                                                   : " from ";
  return fmt::format("{}{} {}{}{}", words_before(*this), range.odd ? "an odd" : "a", kind, link, bounds);
}

std::optional<std::string> accepted(const Option& option, const std::string& text) {
  if (option.type == Option::Type::kFlag || option.type == Option::Type::kText) return text;
  if (is_one_of(option.choices, text)) return text;
  if (!is_number(option)) return {};
  return option.type == Option::Type::kWhole ? accepted_whole(option, text) : accepted_real(option, text);
}

std::string problem_of(const Option& option, const std::string& text) {
  const std::string hint = option.type == Option::Type::kChoice ? did_you_mean(text, option.choices) : "";
  // A whole number without a range of its own is bounded by its type.
  const bool is_too_large = option.type == Option::Type::kWhole && !std::isfinite(option.range.high) &&
                            parse_real(text).value_or(0) >= static_cast<double>(option.most);
  const std::string most = is_too_large ? fmt::format(", at most {}", option.most) : "";
  return fmt::format("'{}': expected {}{}{}", text, option.expected(), most, hint);
}

const Option* find_option(const std::vector<Option>& options, std::string_view name) {
  for (const Option& option : options)
    if (option.name == name || (!option.letter.empty() && option.letter == name)) return &option;
  return nullptr;
}

void refuse_option(const std::string& kind, const std::string& owner, const std::vector<Option>& own,
                   const std::string& option, const std::vector<std::string>& others) {
  if (!others.empty())
    throw Error(ErrorCode::kUsage,
                fmt::format("`{}` is an option of `{}` {}, not of {}", option, kind, fmt::join(others, ", "), owner));
  std::vector<std::string> names;
  for (const Option& o : own) names.push_back(o.name);
  throw Error(ErrorCode::kUsage,
              fmt::format("`{}` is not an option of any {}{}", option, kind, did_you_mean(option, names)));
}

std::string underscored(std::string name) {
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
}

std::string dashed(std::string name) {
  std::replace(name.begin(), name.end(), '_', '-');
  return name;
}

std::vector<std::string> option_words(const std::vector<Option>& options, const OptionValues& values) {
  std::vector<std::string> words;
  for (const Option& option : options) {
    const auto found = values.find(option.name);
    if (found == values.end()) continue;
    if (option.type == Option::Type::kFlag) {
      words.push_back("--" + option.name);
      continue;
    }
    for (const std::string& value : lines_of(option, found->second))
      words.insert(words.end(), {"--" + option.name, value});
  }
  return words;
}

std::vector<std::string> lines_of(const Option& option, const std::string& value) {
  if (!option.repeats) return {value};
  std::vector<std::string> lines;
  size_t at = 0;
  for (size_t end; (end = value.find('\n', at)) != std::string::npos; at = end + 1)
    lines.push_back(value.substr(at, end - at));
  lines.push_back(value.substr(at));
  return lines;
}

std::vector<Option> merged_options(const std::vector<std::string>& owners,
                                   const std::vector<std::vector<Option>>& lists) {
  struct Merged {
    Option option;
    std::string help;
  };
  std::vector<Merged> merged;
  for (size_t i = 0; i < lists.size(); ++i)
    for (const Option& option : lists[i]) {
      const auto known =
          std::find_if(merged.begin(), merged.end(), [&](const Merged& m) { return m.option.name == option.name; });
      const std::string& standard = option.default_value;
      if (known == merged.end()) {
        merged.push_back({option, help_with_default(option)});
        continue;
      }
      for (const std::string& choice : option.choices)
        if (!is_one_of(known->option.choices, choice)) known->option.choices.push_back(choice);
      if (known->option.help != option.help)
        known->help +=
            fmt::format("; {}: {}{}", owners[i], option.help, standard.empty() ? "" : ", default " + standard);
      else if (known->option.default_value != standard)
        known->help += fmt::format(" ({}: {})", owners[i], standard);
    }
  std::vector<Option> options;
  for (Merged& m : merged) {
    m.option.help = m.help, m.option.default_value.clear();
    options.push_back(std::move(m.option));
  }
  return options;
}

std::string help_with_default(const Option& option) {
  const bool has_default = option.type != Option::Type::kFlag && !option.default_value.empty();
  return option.help + (has_default ? "; default " + option.default_value : "");
}

}  // namespace covary
