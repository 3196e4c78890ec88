// SPDX-License-Identifier: Apache-2.0
// Numbers in texts. Those of options have decimal digits only ("010" is ten, "0x10" is invalid) and nothing after them,
// and are never NaN.
#pragma once

#include <charconv>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

namespace covary {

inline std::string_view without_plus(std::string_view text) {
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);
  return text;
}

/// The number in the text, with an optional sign; nothing if it is not one or T cannot hold it.
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

/// Exactly `count` non-negative numbers, separated by `separator`; nothing otherwise. Whole numbers are at most half
/// the range of int64_t, so that two of them can be added.
std::optional<std::vector<int64_t>> parse_whole_numbers(std::string_view text, char separator, size_t count);
std::optional<std::vector<double>> parse_reals(std::string_view text, char separator, size_t count);

/// "1 image", "3 images"; "2 meshes" with `plural` "meshes".
std::string counted(size_t n, std::string_view noun, std::string_view plural = "");

}  // namespace covary
