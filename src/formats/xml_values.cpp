// SPDX-License-Identifier: Apache-2.0
#include "formats/xml_values.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <cstdlib>

#include "core/srgb.h"

namespace covary {
namespace {

[[noreturn]] void fail(const std::string& message) { throw Error(ErrorCode::kInput, message); }

bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }

std::string_view trim(std::string_view text) {
  while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
  return text;
}

/// The start of `text`, short enough for a message.
std::string shown(std::string_view text) {
  return text.size() > 60 ? std::string(text.substr(0, 57)) + "..." : std::string(text);
}

/// Zero, or why the text is not the text of a number: result_out_of_range or invalid_argument.
template <typename T>
std::errc read(std::string_view text, T& value) {
  text = trim(text);
  if (!text.empty() && text.front() == '+') text.remove_prefix(1);
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return end == text.data() + text.size() ? error : std::errc::invalid_argument;
}

float to_float(double v) {
  const float f = static_cast<float>(v);
  if (!std::isfinite(f)) fail(fmt::format("{} is too large", v));
  return f;
}

Spectrum parse_hex(std::string_view text) {
  uint32_t bits = 0;
  const auto [end, error] = std::from_chars(text.data() + 1, text.data() + text.size(), bits, 16);
  if (text.size() != 7 || error != std::errc() || end != text.data() + text.size())
    fail(fmt::format("'{}' is not a colour; expected '#rrggbb'", shown(text)));
  return {srgb_to_linear(static_cast<float>((bits >> 16) & 255) / 255),
          srgb_to_linear(static_cast<float>((bits >> 8) & 255) / 255),
          srgb_to_linear(static_cast<float>(bits & 255) / 255)};
}

std::vector<double> parse_colour_numbers(std::string_view text) {
  std::vector<double> numbers;
  for (std::string_view token : split_list(text)) numbers.push_back(parse_number(token));
  if (numbers.size() == 1) numbers.assign(3, numbers[0]);
  if (numbers.size() != 3)
    fail(fmt::format("'{}' has {} values; a colour is one or three numbers or '#rrggbb'", shown(text), numbers.size()));
  return numbers;
}

}  // namespace

std::vector<std::string_view> split_list(std::string_view text) {
  std::vector<std::string_view> tokens;
  size_t i = 0;
  while (i < text.size()) {
    const auto separates = [&](size_t k) { return is_blank(text[k]) || text[k] == ','; };
    while (i < text.size() && separates(i)) ++i;
    const size_t start = i;
    while (i < text.size() && !separates(i)) ++i;
    if (i > start) tokens.push_back(text.substr(start, i - start));
  }
  return tokens;
}

double parse_number(std::string_view text) {
  double value = 0;
  const std::errc error = read(text, value);
  if (error == std::errc::result_out_of_range) {
    value = std::strtod(std::string(trim(text)).c_str(), nullptr);  // 0 if it is too small
    if (!std::isfinite(value)) fail(fmt::format("'{}' is too large", shown(text)));
    return value;
  }
  if (error != std::errc()) fail(fmt::format("'{}' is not a number", shown(text)));
  if (!std::isfinite(value)) fail(fmt::format("'{}' is not finite", shown(text)));
  return value;
}

int64_t parse_integer(std::string_view text) {
  int64_t value = 0;
  const std::errc error = read(text, value);
  if (error == std::errc::result_out_of_range)
    fail(fmt::format("'{}' is {}", shown(text), trim(text).starts_with('-') ? "too far below zero" : "too large"));
  if (error != std::errc()) fail(fmt::format("'{}' is not an integer", shown(text)));
  return value;
}

bool parse_boolean(std::string_view text) {
  std::string lower(trim(text));
  for (char& c : lower) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  if (lower == "true") return true;
  if (lower == "false") return false;
  fail(fmt::format("'{}' is not a boolean; expected 'true' or 'false'", shown(text)));
}

std::vector<double> parse_numbers(std::string_view text, size_t count) {
  const std::vector<std::string_view> tokens = split_list(text);
  if (tokens.size() != count) fail(fmt::format("'{}' has {} values; expected {}", shown(text), tokens.size(), count));
  std::vector<double> numbers;
  for (std::string_view token : tokens) numbers.push_back(parse_number(token));
  return numbers;
}

ColourValue parse_rgb(std::string_view text) {
  text = trim(text);
  if (!text.empty() && text.front() == '#') return {parse_hex(text)};
  const std::vector<double> v = parse_colour_numbers(text);
  return {{to_float(v[0]), to_float(v[1]), to_float(v[2])}};
}

ColourValue parse_srgb(std::string_view text) {
  text = trim(text);
  if (!text.empty() && text.front() == '#') return {parse_hex(text)};
  const std::vector<double> v = parse_colour_numbers(text);
  return {{srgb_to_linear(to_float(v[0])), srgb_to_linear(to_float(v[1])), srgb_to_linear(to_float(v[2]))}};
}

SampledSpectrum make_spectrum(const std::vector<double>& wavelengths, const std::vector<double>& values) {
  if (wavelengths.size() != values.size())
    fail(fmt::format("a spectrum has {} wavelengths but {} values", wavelengths.size(), values.size()));
  if (wavelengths.size() < 2) fail("a spectrum needs at least two wavelengths");
  SampledSpectrum spectrum;
  for (size_t i = 0; i < wavelengths.size(); ++i) {
    const auto sample = std::make_pair(to_float(wavelengths[i]), to_float(values[i]));
    if (i > 0 && !(sample.first > spectrum.samples.back().first))
      fail(fmt::format("the wavelengths of a spectrum must increase, but {} follows {}", wavelengths[i],
                       wavelengths[i - 1]));
    spectrum.samples.push_back(sample);
  }
  return spectrum;
}

std::optional<ColourValue> parse_spectrum_triple(std::string_view text) {
  const std::vector<std::string_view> tokens = split_list(text);
  if (tokens.size() != 3 || text.find(':') != std::string_view::npos) return std::nullopt;
  return parse_rgb(text);
}

SampledSpectrum parse_spectrum(std::string_view text) {
  const std::vector<std::string_view> tokens = split_list(text);
  if (tokens.size() == 1 && tokens[0].find(':') == std::string_view::npos)
    return {{{0.0f, to_float(parse_number(tokens[0]))}}};
  std::vector<double> wavelengths, values;
  for (std::string_view token : tokens) {
    const size_t colon = token.find(':');
    if (colon == std::string_view::npos)
      fail(
          fmt::format("'{}' is not a spectrum sample; expected one number, or 'wavelength:value' pairs", shown(token)));
    wavelengths.push_back(parse_number(token.substr(0, colon)));
    values.push_back(parse_number(token.substr(colon + 1)));
  }
  return make_spectrum(wavelengths, values);
}

SampledSpectrum parse_spectrum_file(std::string_view text) {
  std::vector<double> wavelengths, values;
  for (size_t start = 0, line = 1; start < text.size(); ++line) {
    const size_t end = std::min(text.find('\n', start), text.size());
    std::string_view content = text.substr(start, end - start);
    content = content.substr(0, content.find('#'));
    start = end + 1;
    const std::vector<std::string_view> tokens = split_list(content);
    if (tokens.empty()) continue;
    double wavelength = 0, value = 0;
    if (tokens.size() != 2 || read(tokens[0], wavelength) != std::errc() || read(tokens[1], value) != std::errc() ||
        !std::isfinite(wavelength) || !std::isfinite(value))
      fail(fmt::format("line {} is '{}'; expected a wavelength and a value", line, shown(trim(content))));
    wavelengths.push_back(wavelength), values.push_back(value);
  }
  return make_spectrum(wavelengths, values);
}

SampledSpectrum blackbody_spectrum(double temperature, double scale) {
  if (!(temperature > 0 && temperature <= 1e6))
    fail(fmt::format("the temperature {} K of a black body must lie in (0, 1000000]", temperature));
  constexpr double kC = 299792458, kH = 6.62607015e-34, kB = 1.380649e-23;  // CODATA 2018, exact
  SampledSpectrum spectrum;
  for (int nm = 360; nm <= 830; ++nm) {
    const double lambda = nm * 1e-9;
    const double radiance =
        2 * kH * kC * kC / (std::pow(lambda, 5) * std::expm1(kH * kC / (lambda * kB * temperature)));
    spectrum.samples.emplace_back(static_cast<float>(nm), to_float(radiance * 1e-9 * scale));
  }
  return spectrum;
}

}  // namespace covary
