// SPDX-License-Identifier: Apache-2.0
#include "numbers.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <functional>

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
    return fmt::format("'{}': expected {}{}", text, fmt::join(names, ", "), did_you_mean(text, names));
  };
  return {check, fmt::format("{{{}}}", fmt::join(names, ",")), "name"};
}

std::vector<int64_t> parse_numbers(const std::string& option, const std::string& text, char separator, size_t count,
                                   const std::string& example) {
  const std::optional<std::vector<int64_t>> numbers = parse_whole_numbers(text, separator, count);
  if (!numbers) throw Error(ErrorCode::kUsage, option + " '" + text + "': expected " + example);
  return *numbers;
}

void add_threads_option(CLI::App& command, int& threads, const std::string& what) {
  command.add_option("--threads", threads, what + "; default: all")->transform(whole_number(1, kMaxThreads));
}

}  // namespace covary
