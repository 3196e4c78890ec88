// SPDX-License-Identifier: Apache-2.0
// Numbers on the command line, the same in all commands: decimal digits ("010" is ten, "0x10" is invalid), nothing
// after them, in the valid range, never NaN.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/number_text.h"

namespace covary {

/// For CLI::Option::transform(): a whole number from `low` to `high`.
template <typename T>
CLI::Validator whole_number(T low, T high) {
  const auto check = [low, high](std::string& text) -> std::string {
    const std::optional<T> value = parse_number<T>(text);
    if (!value || *value < low || *value > high)
      return "'" + text + "': expected a whole number from " + std::to_string(low) + " to " + std::to_string(high);
    text = std::to_string(*value);  // without leading zeros, which CLI11 would read as octal
    return "";
  };
  return {check, "", "whole number"};
}

/// Likewise, for check(): a finite number from `low` to `high`, which may be infinite.
CLI::Validator real_number(double low, double high);
/// A finite number above 0; any finite number.
CLI::Validator positive_number();
CLI::Validator finite_number();

/// For CLI::Option::check(): one of these names.
CLI::Validator one_of(const std::vector<std::string>& names);

/// Whole numbers from 0 on, separated by `separator`; throws Error(kUsage) naming the option.
std::vector<int64_t> parse_numbers(const std::string& option, const std::string& text, char separator, size_t count,
                                   const std::string& example);

/// Adds --threads; 0 means all.
void add_threads_option(CLI::App& command, int& threads, const std::string& what = "Number of threads");

}  // namespace covary
