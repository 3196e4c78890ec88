// SPDX-License-Identifier: Apache-2.0
// Numbers as options have them: decimal digits ("010" is ten, "0x10" is none), nothing behind them, never not-a-number.
#pragma once

#include <charconv>
#include <cstdint>
#include <optional>
#include <string_view>
#include <system_error>
#include <vector>

namespace covary {

inline std::string_view without_plus(std::string_view text) {
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);
  return text;
}

/// The number that the text is, with an optional sign; nothing where it is none or T does not hold it.
template <typename T>
std::optional<T> parse_number(std::string_view text) {
  text = without_plus(text);
  T value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return {};
  return value;
}

/// Likewise; finite, with an optional fraction and exponent.
std::optional<double> parse_real(std::string_view text);

/// Numbers from 0 on between separators; nothing where there are not exactly `count`. Whole numbers are at most half of
/// what they can be, so that two of them can be added.
std::optional<std::vector<int64_t>> parse_whole_numbers(std::string_view text, char separator, size_t count);
std::optional<std::vector<double>> parse_reals(std::string_view text, char separator, size_t count);

}  // namespace covary
