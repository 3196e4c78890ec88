// SPDX-License-Identifier: Apache-2.0
#include "settings/option_names.h"

#include <algorithm>

#include "settings/option.h"

namespace covary {
namespace {

bool is_option_name(const std::string& text) {
  const auto fits = [](char c) { return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '-'; };
  return !text.empty() && text[0] >= 'a' && text[0] <= 'z' && std::all_of(text.begin(), text.end(), fits);
}

/// `shown(name, at)`: the name as it is shown; `at` is the position after it, which may move past what is shown, too.
template <typename Shown>
std::string with_names(const std::string& text, const Shown& shown) {
  std::string result;
  size_t at = 0;
  for (size_t open; (open = text.find('`', at)) != std::string::npos;) {
    const size_t close = text.find('`', open + 1);
    if (close == std::string::npos) break;
    const std::string name = text.substr(open + 1, close - open - 1);
    result += text.substr(at, open - at);
    at = close;  // the closing quote of one may open the next
    result += is_option_name(name) ? shown(name, ++at) : "`" + name;
  }
  return result + text.substr(at);
}

/// "=off" if the text at `at`, which then moves behind it, begins with a value of the option: " off".
std::string value_after(const Option& option, const std::string& text, size_t& at) {
  if (at >= text.size() || text[at] != ' ') return "";
  const size_t end = std::min(text.find_first_of(" ,;:)", at + 1), text.size());
  const std::string word = text.substr(at + 1, end - at - 1);
  if (!accepted(option, word)) return "";
  at = end;
  return "=" + word;
}

}  // namespace

std::string as_flags(const std::string& text) { return as_flags(text, {}); }

bool is_parameter(const Option& option) {
  return option.type != Option::Type::kFlag && option.level == OptionLevel::kExpert;
}

std::string as_flags(const std::string& text, const std::vector<Option>& parameters) {
  return with_names(text, [&](const std::string& name, size_t& at) {
    const Option* parameter = find_option(parameters, name);
    return parameter ? "--set " + name + value_after(*parameter, text, at) : "--" + name;
  });
}

std::vector<std::string> method_words(const std::vector<Option>& options, const OptionValues& values) {
  std::vector<std::string> words;
  for (const Option& option : options) {
    const std::vector<std::string> own = option_words({option}, values);
    if (own.empty() || !is_parameter(option))
      words.insert(words.end(), own.begin(), own.end());
    else
      words.insert(words.end(), {"--set", option.name + "=" + values.at(option.name)});
  }
  return words;
}

std::string as_arguments(const std::string& text) {
  return with_names(text, [](const std::string& name, size_t&) { return underscored(name); });
}

}  // namespace covary
