// SPDX-License-Identifier: Apache-2.0
#include "numbers.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "core/error.h"

namespace covary {
namespace {

constexpr int kMaxThreads = 4096;

CLI::Validator real_validator(const std::string& expected, const std::function<bool(double)>& accepts) {
  const auto check = [expected, accepts](const std::string& text) -> std::string {
    const std::optional<double> value = parse_real(text);
    return value && accepts(*value) ? "" : fmt::format("'{}': expected {}", text, expected);
  };
  return {check, "", "number"};
}

}  // namespace

std::optional<double> parse_real(std::string_view text) {
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

CLI::Validator real_number(double low, double high) {
  return real_validator(std::isfinite(high) ? fmt::format("a number from {:g} to {:g}", low, high)
                                            : fmt::format("a number of at least {:g}", low),
                        [low, high](double value) { return value >= low && value <= high; });
}

CLI::Validator positive_number() {
  return real_validator("a positive number", [](double value) { return value > 0; });
}

CLI::Validator finite_number() {
  return real_validator("a number", [](double) { return true; });
}

CLI::Validator one_of(const std::vector<std::string>& names) {
  const auto check = [names](const std::string& text) -> std::string {
    if (std::find(names.begin(), names.end(), text) != names.end()) return "";
    return fmt::format("'{}'{}: expected {}", text, did_you_mean(text, names), fmt::join(names, ", "));
  };
  return {check, fmt::format("{{{}}}", fmt::join(names, ",")), "name"};
}

std::vector<int64_t> parse_numbers(const std::string& option, const std::string& text, char separator, size_t count,
                                   const std::string& example) {
  std::vector<int64_t> numbers;
  size_t begin = 0;
  while (begin <= text.size()) {
    const size_t end = std::min(text.find(separator, begin), text.size());
    const std::optional<int64_t> number = parse_whole<int64_t>(std::string_view(text).substr(begin, end - begin));
    // Half of the range, so that two of them can be added.
    if (!number || *number < 0 || *number > std::numeric_limits<int64_t>::max() / 2) break;
    numbers.push_back(*number);
    begin = end + 1;
  }
  if (numbers.size() != count || begin <= text.size())
    throw Error(ErrorCode::kUsage, option + " '" + text + "': expected " + example);
  return numbers;
}

void add_threads_option(CLI::App& command, int& threads, const std::string& what) {
  command.add_option("--threads", threads, what + "; default: all")->transform(whole_number(1, kMaxThreads));
}

}  // namespace covary
