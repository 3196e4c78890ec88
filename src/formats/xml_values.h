// SPDX-License-Identifier: Apache-2.0
// Parses values in attributes of scene files. All functions throw Error(kInput) with the invalid text and what is
// expected; the caller adds the location.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "scene/parameters.h"

namespace covary {

/// Splits at white space and commas.
std::vector<std::string_view> split_list(std::string_view text);
std::vector<std::string_view> split_list(std::string&&) = delete;  // the parts are views of the text

/// A finite number; surrounding white space is ignored.
double parse_number(std::string_view text);
int64_t parse_integer(std::string_view text);
bool parse_boolean(std::string_view text);
/// `count` numbers.
std::vector<double> parse_numbers(std::string_view text, size_t count);

/// Linear RGB: one number (grey), three numbers, or "#rrggbb" (sRGB-encoded).
ColourValue parse_rgb(std::string_view text);
/// The same, but numbers are sRGB-encoded too.
ColourValue parse_srgb(std::string_view text);

/// Three numbers without wavelengths: in Mitsuba 0.x, which by default renders with three components, a spectrum of
/// linear R, G and B. Nothing if the text is something else.
std::optional<ColourValue> parse_spectrum_triple(std::string_view text);

/// "0.5" (constant), or at least two "wavelength:value" pairs with increasing wavelengths in nanometres.
SampledSpectrum parse_spectrum(std::string_view text);
/// Lines of "wavelength value"; "#" starts a comment. `text` is the content of an .spd file.
SampledSpectrum parse_spectrum_file(std::string_view text);
/// Pairs from the two lists; throws like parse_spectrum.
SampledSpectrum make_spectrum(const std::vector<double>& wavelengths, const std::vector<double>& values);

/// Planck's law in W / (m^2 sr nm), in steps of 1 nm over the visible range. `temperature` in kelvin.
SampledSpectrum blackbody_spectrum(double temperature, double scale);

}  // namespace covary
