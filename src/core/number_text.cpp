// SPDX-License-Identifier: Apache-2.0
#include "core/number_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace covary {
namespace {

template <typename T, typename Read>
std::optional<std::vector<T>> parse_list(std::string_view text, char separator, size_t count, const Read& read) {
  std::vector<T> numbers;
  for (size_t begin = 0; begin <= text.size();) {
    const size_t end = std::min(text.find(separator, begin), text.size());
    const std::optional<T> number = read(text.substr(begin, end - begin));
    if (!number || !(*number >= 0)) return {};
    numbers.push_back(*number);
    begin = end + 1;
  }
  return numbers.size() == count ? std::optional(numbers) : std::nullopt;
}

}  // namespace

std::optional<double> parse_real(std::string_view text) {
  const std::optional<double> value = parse_number<double>(text);
  return value && std::isfinite(*value) ? value : std::nullopt;
}

std::optional<std::vector<int64_t>> parse_whole_numbers(std::string_view text, char separator, size_t count) {
  return parse_list<int64_t>(text, separator, count, [](std::string_view part) {
    const std::optional<int64_t> number = parse_number<int64_t>(part);
    return number && *number <= std::numeric_limits<int64_t>::max() / 2 ? number : std::nullopt;
  });
}

std::optional<std::vector<double>> parse_reals(std::string_view text, char separator, size_t count) {
  return parse_list<double>(text, separator, count, parse_real);
}

std::string counted(size_t n, std::string_view noun, std::string_view plural) {
  if (n == 1) return fmt::format("1 {}", noun);
  return plural.empty() ? fmt::format("{} {}s", n, noun) : fmt::format("{} {}", n, plural);
}

}  // namespace covary
