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

template <typename Shown>
std::string with_names(const std::string& text, const Shown& shown) {
  std::string result;
  size_t at = 0;
  for (size_t open; (open = text.find('`', at)) != std::string::npos;) {
    const size_t close = text.find('`', open + 1);
    if (close == std::string::npos) break;
    const std::string name = text.substr(open + 1, close - open - 1);
    const bool is_name = is_option_name(name);
    result += text.substr(at, open - at) + (is_name ? shown(name) : "`" + name);
    at = is_name ? close + 1 : close;  // the closing quote of one may open the next
  }
  return result + text.substr(at);
}

}  // namespace

std::string as_flags(const std::string& text) {
  return with_names(text, [](const std::string& name) { return "--" + name; });
}

std::string as_arguments(const std::string& text) { return with_names(text, underscored); }

}  // namespace covary
