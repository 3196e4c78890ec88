// SPDX-License-Identifier: Apache-2.0
// Numbers and colours in pbrt scene files.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "formats/xml_values.h"
#include "pbrt/pbrt_objects.h"

namespace covary {
namespace {

/// The texture that the parameter names, of floats or spectra; null after an error.
ObjectPtr find_texture(PbrtParameters& p, const PbrtParameter& parameter, PbrtKind kind, PbrtNames& names) {
  const std::string& name = parameter.strings.empty() ? "" : parameter.strings[0];
  if (const PbrtDefinitionPtr definition = names.find(kind, name, p.order())) return names.make(*definition);
  p.error_at(parameter, fmt::format("names the texture '{}', which is not a texture of {}{}", name,
                                    kind == PbrtKind::kFloatTexture ? "floats" : "spectra",
                                    did_you_mean(name, names.known(kind))));
  return nullptr;
}

/// Alternating wavelengths and values.
std::optional<SampledSpectrum> sampled(PbrtParameters& p, const PbrtParameter& parameter) {
  std::vector<double> wavelengths, values;
  for (size_t i = 0; i < parameter.numbers.size(); ++i) (i % 2 ? values : wavelengths).push_back(parameter.numbers[i]);
  try {
    return make_spectrum(wavelengths, values);
  } catch (const Error& error) {
    p.error_at(parameter, std::string("is not a list of wavelengths and values: ") + error.what());
    return std::nullopt;
  }
}

std::optional<ColourValue> rgb(PbrtParameters& p, const PbrtParameter& parameter) {
  const std::vector<double>& n = parameter.numbers;
  if (n.size() == 3 && std::ranges::all_of(n, [](double x) { return x >= 0; })) {
    const Spectrum colour = p.to_rec709({static_cast<float>(n[0]), static_cast<float>(n[1]), static_cast<float>(n[2])});
    if (std::min({colour.r, colour.g, colour.b}) < 0)
      p.warn("has colours outside Rec. 709; they are brought to its border");
    return ColourValue{{std::max(colour.r, 0.0f), std::max(colour.g, 0.0f), std::max(colour.b, 0.0f)}};
  }
  p.error_at(parameter, "is not a colour; expected three non-negative numbers");
  return std::nullopt;
}

/// False, with an error as in pbrt, for a colour that no surface can have; version 3 clamps it.
bool check_reflectance(PbrtParameters& p, const std::string& name, Value& value, const PbrtNames& names) {
  auto* colour = std::get_if<ColourValue>(&value);
  if (!colour || max_component(colour->rgb) <= 1) return true;
  if (names.version_3 || p.to_rec709({1, 0, 0}) != Spectrum(1, 0, 0)) {
    for (int c = 0; c < 3; ++c) colour->rgb[c] = std::min(colour->rgb[c], 1.0f);
    return true;
  }
  p.error_at(*p.find(name),
             fmt::format("is the colour {}, {}, {}; expected at most 1", colour->rgb.r, colour->rgb.g, colour->rgb.b));
  return false;
}

/// Whether a texture may give a reflectance above 1: by a factor, or by a spectrum.
bool may_exceed_1(const ObjectPtr& texture) {
  const auto above_1 = [](const Property& p) {
    if (const auto* colour = std::get_if<ColourValue>(&p.value)) return max_component(colour->rgb) > 1;
    if (const auto* spectrum = std::get_if<SampledSpectrum>(&p.value))
      return std::ranges::any_of(spectrum->samples, [](const auto& sample) { return sample.second > 1; });
    const double* value = std::get_if<double>(&p.value);
    return value && *value > 1 && p.name != "maximum" && p.name != "gamma";
  };
  const auto exceeds = [&](const ObjectDescription& object) {
    if (object.type == "noise") return true;
    const bool clamped = std::ranges::any_of(object.properties, [](const Property& p) { return p.name == "maximum"; });
    return object.type != "bitmap" && !clamped && std::ranges::any_of(object.properties, above_1);
  };
  bool found = exceeds(*texture);
  visit_properties(*texture, [&](const ObjectDescription&, const Property& property) {
    if (const ObjectPtr* child = std::get_if<ObjectPtr>(&property.value); child && *child) found |= exceeds(**child);
  });
  return found;
}

/// A spectrum by name, for anything but light.
std::optional<Value> named_spectrum(PbrtParameters& p, const PbrtParameter& parameter, PbrtNames& names) {
  if (parameter.strings.size() != 1) {
    p.error_at(parameter, "is not a spectrum: expected one name, or wavelengths and values");
    return std::nullopt;
  }
  Diagnostics missing;
  if (const auto metal = pbrt_metal(parameter.strings[0]);
      metal && names.files().resolve(parameter.strings[0], parameter.where, missing).empty())
    return ColourValue{*metal};
  if (const auto glass = pbrt_glass(parameter.strings[0])) return *glass;
  if (const auto illuminant = pbrt_illuminant(parameter.strings[0])) return ColourValue{*illuminant};
  const auto spectrum = pbrt_spectrum_file(p, parameter, names);
  return spectrum ? std::optional<Value>(*spectrum) : std::nullopt;
}

}  // namespace

std::optional<Value> float_value(PbrtParameters& p, const std::string& name, double fallback, PbrtNames& names) {
  const PbrtParameter* parameter = p.find(name);
  if (!parameter) return fallback;
  if (parameter->type != "texture") return p.get_float(name, fallback);
  const ObjectPtr texture = find_texture(p, *parameter, PbrtKind::kFloatTexture, names);
  return texture ? std::optional<Value>(texture) : std::nullopt;
}

std::optional<Value> spectrum_value(PbrtParameters& p, const std::string& name, PbrtNames& names) {
  const PbrtParameter* parameter = p.find(name);
  if (!parameter) return std::nullopt;
  if (parameter->type == "texture") {
    const ObjectPtr texture = find_texture(p, *parameter, PbrtKind::kSpectrumTexture, names);
    return texture ? std::optional<Value>(texture) : std::nullopt;
  }
  if (parameter->type == "rgb") {
    const auto colour = rgb(p, *parameter);
    return colour ? std::optional<Value>(*colour) : std::nullopt;
  }
  if (parameter->type == "blackbody" && !parameter->numbers.empty() && parameter->numbers[0] > 0)
    return pbrt_blackbody(parameter->numbers[0]);
  if (parameter->type == "spectrum" && !parameter->strings.empty()) return named_spectrum(p, *parameter, names);
  if (parameter->type == "spectrum") {
    const auto spectrum = sampled(p, *parameter);
    return spectrum ? std::optional<Value>(*spectrum) : std::nullopt;
  }
  p.error_at(*parameter,
             fmt::format("has the type '{}'; expected 'rgb', 'spectrum', 'blackbody' with a temperature, or "
                         "'texture'",
                         parameter->type));
  return std::nullopt;
}

Value as_reflectance(const Value& value, const PbrtNames& names) {
  const ObjectPtr* texture = std::get_if<ObjectPtr>(&value);
  const auto other = texture ? names.reflectances.find(*texture) : names.reflectances.end();
  return other == names.reflectances.end() ? value : Value(other->second);
}

std::optional<Value> reflectance_value(PbrtParameters& p, const std::string& name, PbrtNames& names) {
  std::optional<Value> value = spectrum_value(p, name, names);
  if (!value || !check_reflectance(p, name, *value, names)) return std::nullopt;
  const Value reflected = as_reflectance(*value, names);
  const ObjectPtr* texture = std::get_if<ObjectPtr>(&reflected);
  return texture && may_exceed_1(*texture) ? Value(scaled_texture(p.where(), 1.0, *texture, 1.0)) : reflected;
}

Spectrum plain_colour(const Value& value) {
  if (const auto* colour = std::get_if<ColourValue>(&value)) return colour->rgb;
  if (const auto* number = std::get_if<double>(&value)) return Spectrum(static_cast<float>(*number));
  if (const auto* spectrum = std::get_if<SampledSpectrum>(&value))
    return spectrum_to_rgb(*spectrum, SpectrumRole::kIndex);
  return {};
}

Spectrum light_colour(PbrtParameters& p, const std::string& name, PbrtNames& names) {
  const PbrtParameter* parameter = p.find(name);
  if (!parameter) return Spectrum(1);
  if (parameter->type == "rgb") {
    const auto colour = rgb(p, *parameter);
    return colour ? colour->rgb : Spectrum(1);
  }
  std::optional<SampledSpectrum> spectrum;
  double scale = 1;
  const size_t n = parameter->numbers.size();
  if (parameter->type == "blackbody" && (n == 1 || n == 2) && parameter->numbers[0] > 0) {
    spectrum = pbrt_blackbody(parameter->numbers[0]);
    scale = n == 2 ? parameter->numbers[1] : 1;
    if (n == 2 && !names.version_3)  // written by exporters, Assimp's among them
      p.warn("has a blackbody with two numbers, which is of version 3; the second is taken as a factor");
  } else if (parameter->type == "spectrum" && parameter->strings.size() == 1) {
    if (const auto illuminant = pbrt_illuminant(parameter->strings[0]))
      return parameter->strings[0] == "stdillum-D65" ? Spectrum(1) : *illuminant;
    spectrum = pbrt_spectrum_file(p, *parameter, names);
    if (!spectrum) return Spectrum(1);
  } else if (parameter->type == "spectrum" && parameter->strings.empty()) {
    spectrum = sampled(p, *parameter);
  } else {
    p.error_at(*parameter, "is not a light colour: expected 'rgb', 'blackbody' with a temperature, or 'spectrum'");
  }
  if (!spectrum) return Spectrum(1);
  const Spectrum colour = spectrum_to_rgb(*spectrum, SpectrumRole::kEmission);
  if (names.version_3) return colour * static_cast<float>(scale);
  const float y = luminance(colour);
  if (y > 0) return colour * (static_cast<float>(scale) / y);
  p.error_at(*parameter, "is black");
  return Spectrum(1);
}

double index_of_refraction(PbrtParameters& p, double fallback, PbrtNames& names) {
  const PbrtParameter* eta = p.find("eta");
  if (!eta) return fallback;
  if (eta->type == "float") return p.get_float("eta", fallback);
  if (eta->type == "texture") {
    const auto texture = float_value(p, "eta", fallback, names);
    const auto* object = texture ? std::get_if<ObjectPtr>(&*texture) : nullptr;
    if (object && (*object)->type == "uniform")
      for (const Property& property : (*object)->properties)
        if (const double* number = std::get_if<double>(&property.value)) return *number;
    if (texture) p.error_at(*eta, "is a texture that varies; expected a number or a spectrum");
    return fallback;
  }
  const std::string glass = eta->strings.size() == 1 ? eta->strings[0] : "";
  if (const auto index = pbrt_glass(glass)) {
    p.warn(fmt::format("refracts all colours alike: {} has the index {}", glass, *index));
    return *index;
  }
  if (eta->type == "rgb") {
    const auto colour = rgb(p, *eta);
    if (!colour) return fallback;
    const double index = double{luminance(colour->rgb)};
    if (colour->rgb != Spectrum(colour->rgb.g))
      p.warn(fmt::format("refracts all colours alike, with the index {}, the luminance of its colour", index));
    return index;
  }
  const auto spectrum = eta->type == "spectrum" ? spectrum_value(p, "eta", names) : std::nullopt;
  const auto* values = spectrum ? std::get_if<SampledSpectrum>(&*spectrum) : nullptr;
  if (!values || values->samples.empty()) {
    p.error_at(*eta, "is not an index of refraction: expected a float, a spectrum, or a glass such as 'glass-BK7'");
    return fallback;
  }
  const auto& samples = values->samples;
  const auto above = std::ranges::find_if(samples, [](const auto& sample) { return sample.first >= 589.0f; });
  double index = above == samples.end() ? samples.back().second : above->second;
  if (above != samples.begin() && above != samples.end()) {
    const auto& [w0, v0] = *std::prev(above);
    index = lerp((589.0f - w0) / (above->first - w0), v0, above->second);
  }
  if (samples.size() > 1) p.warn(fmt::format("refracts all colours alike, with the index {} at 589 nm", index));
  return index;
}

}  // namespace covary
