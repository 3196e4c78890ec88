// SPDX-License-Identifier: Apache-2.0
// Numbers, colours and textures in pbrt scene files.
#include <fmt/format.h>

#include <algorithm>
#include <cctype>

#include "formats/pbrt_objects.h"
#include "formats/xml_values.h"

namespace covary {
namespace {

ObjectPtr find_texture(PbrtParameters& p, const PbrtParameter& parameter, const std::map<std::string, ObjectPtr>& all,
                       const char* of) {
  const std::string& name = parameter.strings.empty() ? "" : parameter.strings[0];
  const auto found = all.find(name);
  if (found != all.end()) return found->second;
  std::vector<std::string> known;
  for (const auto& [other, texture] : all) known.push_back(other);
  p.error_at(parameter, fmt::format("names the texture '{}', which is not a texture of {}{}", name, of,
                                    did_you_mean(name, known)));
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
  if (n.size() == 3 && std::ranges::all_of(n, [](double x) { return x >= 0; }))
    return ColourValue{{static_cast<float>(n[0]), static_cast<float>(n[1]), static_cast<float>(n[2])}};
  p.error_at(parameter, "is not a colour; expected three non-negative numbers");
  return std::nullopt;
}

bool of_numbers(const PbrtParameters& p) { return p.what().starts_with("Texture \"float\""); }

/// The same object, if both are textures; other values are not compared.
bool same(const Value& a, const Value& b) {
  const ObjectPtr *first = std::get_if<ObjectPtr>(&a), *second = std::get_if<ObjectPtr>(&b);
  return !first || !second || *first == *second;
}

/// False, with an error as in pbrt, for a colour that no surface can have.
bool check_reflectance(PbrtParameters& p, const std::string& name, const Value& value) {
  const auto* colour = std::get_if<ColourValue>(&value);
  if (!colour || max_component(colour->rgb) <= 1) return true;
  p.error_at(*p.find(name),
             fmt::format("is the colour {}, {}, {}; expected at most 1", colour->rgb.r, colour->rgb.g, colour->rgb.b));
  return false;
}

/// pbrt's mapping of (u, v), followed by `more`.
Transform texture_mapping(PbrtParameters& p, const Transform& more) {
  if (const std::string mapping = p.get_string("mapping", "uv"); mapping != "uv")
    p.error(fmt::format("has the mapping '{}'; supported: 'uv'", mapping));
  const auto number = [&](const char* name, double fallback) {
    return static_cast<float>(p.get_float(name, fallback));
  };
  const Vec3 scale{number("uscale", 1), number("vscale", 1), 1}, shift{number("udelta", 0), number("vdelta", 0), 0};
  if (scale.x == 0 || scale.y == 0) {
    p.error("has a scale of 0");
    return more;
  }
  return more * Transform::translate(shift) * Transform::scale(scale);
}

/// A texture times a number; values above `maximum`, if it is given, are clamped.
ObjectBuilder scaled(const SourceLocation& where, double scale, const ObjectPtr& texture,
                     std::optional<double> maximum = std::nullopt) {
  auto result = make_object("texture", "scale", where, {{"scale", scale}, {"", texture}});
  if (maximum) set_property(*result, "maximum", *maximum);
  return result;
}

bool has_extension(std::string name, std::initializer_list<const char*> extensions) {
  std::ranges::transform(name, name.begin(), [](unsigned char c) { return std::tolower(c); });
  return std::ranges::any_of(extensions, [&](const char* extension) { return name.ends_with(extension); });
}

ObjectBuilder image_texture(PbrtParameters& p, PbrtNames& names) {
  const std::string filename = p.get_string("filename", "");
  auto bitmap = make_object("texture", "bitmap", p.where(), {{"filename", filename}});
  // pbrt's v = 0 is the bottom of the image.
  const Transform flip = Transform::translate({0, 1, 0}) * Transform::scale({1, -1, 1});
  set_property(*bitmap, "to_uv", texture_mapping(p, flip));
  const std::string wrap = p.get_string("wrap", "repeat"), filter = p.get_string("filter", "bilinear");
  if (wrap == "repeat" || wrap == "clamp")
    set_property(*bitmap, "wrap_mode", wrap);
  else
    p.error(fmt::format("has wrap '{}'; supported: 'repeat' and 'clamp'", wrap));
  set_property(*bitmap, "filter_type", std::string(filter == "point" ? "nearest" : "bilinear"));
  p.ignore({"maxanisotropy"});
  const std::string encoding = p.get_string("encoding", "sRGB");
  if (encoding != "sRGB" && encoding != "linear")
    p.error(fmt::format("has encoding '{}'; supported: 'sRGB' and 'linear'", encoding));
  // pbrt reads the encoding of PNG files alone: other integers are sRGB, floats linear (image.cpp: Image::Read).
  set_property(*bitmap, "raw", encoding == "linear" && has_extension(filename, {".png"}));
  if (of_numbers(p)) set_property(*bitmap, "grey", std::string("alpha_or_mean"));
  if (p.get_bool("invert", false)) p.error("is inverted, which is not supported");
  const double scale = p.get_float("scale", 1);
  const ObjectBuilder texture = scale == 1 ? bitmap : scaled(p.where(), scale, bitmap);
  if (scale > 1 || has_extension(filename, {".exr", ".pfm", ".hdr"}))  // pbrt clamps images used as reflectances
    names.reflectances[texture] = scaled(p.where(), scale, bitmap, 1.0);
  return texture;
}

/// A texture's input: a number, a colour or another texture.
std::optional<Value> either(PbrtParameters& p, const std::string& name, double fallback, const PbrtNames& names) {
  if (of_numbers(p)) return float_value(p, name, fallback, names);
  if (!p.has(name)) return fallback;
  std::optional<Value> value = spectrum_value(p, name, names);
  if (value && !check_reflectance(p, name, *value)) value.reset();
  return value;
}

/// The texture or colour that pbrt looks up for a reflectance.
Value as_reflectance(const Value& value, const PbrtNames& names) {
  const ObjectPtr* texture = std::get_if<ObjectPtr>(&value);
  const auto other = texture ? names.reflectances.find(*texture) : names.reflectances.end();
  return other == names.reflectances.end() ? value : Value(other->second);
}

ObjectBuilder checkerboard(PbrtParameters& p, PbrtNames& names) {
  if (p.get_integer("dimension", 2) != 2) p.error("has three dimensions; supported: two");
  auto board = make_object("texture", "checkerboard", p.where());
  // pbrt's squares have side 1, ours 1/2.
  set_property(*board, "to_uv", texture_mapping(p, Transform::scale({0.5f, 0.5f, 1})));
  const auto first = either(p, "tex1", 1, names), second = either(p, "tex2", 0, names);
  if (!first || !second) return nullptr;
  const Value reflected[] = {as_reflectance(*first, names), as_reflectance(*second, names)};
  if (!same(reflected[0], *first) || !same(reflected[1], *second)) {
    auto other = std::make_shared<ObjectDescription>(*board);
    set_property(*other, "color0", reflected[0]);
    set_property(*other, "color1", reflected[1]);
    names.reflectances[board] = other;
  }
  set_property(*board, "color0", *first);
  set_property(*board, "color1", *second);
  return board;
}

ObjectBuilder scaled_texture(PbrtParameters& p, PbrtNames& names) {
  const auto texture = either(p, "tex", 1, names);
  const auto factor = float_value(p, "scale", 1, names);
  if (!texture || !factor) return nullptr;
  if (!std::holds_alternative<double>(*factor)) {
    p.error("scales by a texture; supported: a number");
    return nullptr;
  }
  const double scale = std::get<double>(*factor);
  if (!std::holds_alternative<ObjectPtr>(*texture))
    return scaled(p.where(), scale, make_object("texture", "uniform", p.where(), {{"value", *texture}}));
  ObjectBuilder result = scaled(p.where(), scale, std::get<ObjectPtr>(*texture));
  if (const Value reflected = as_reflectance(*texture, names); !same(reflected, *texture))
    names.reflectances[result] = scaled(p.where(), scale, std::get<ObjectPtr>(reflected));
  return result;
}

/// Whether a texture may give a reflectance above 1: by a factor, or by a spectrum.
bool may_exceed_1(const ObjectPtr& texture) {
  const auto number = [](const Property& p) {
    const double* value = std::get_if<double>(&p.value);
    return value ? *value : 0;
  };
  const auto exceeds = [&](const ObjectDescription& object) {
    const auto has = [&](const char* name, auto test) {
      return std::ranges::any_of(object.properties, [&](const Property& p) { return p.name == name && test(p); });
    };
    return object.type == "scale" && has("scale", [&](const Property& p) { return number(p) > 1; }) &&
           !has("maximum", [](const Property&) { return true; });
  };
  bool found = exceeds(*texture);
  visit_properties(*texture, [&](const ObjectDescription&, const Property& property) {
    if (const ObjectPtr* child = std::get_if<ObjectPtr>(&property.value); child && *child) found |= exceeds(**child);
    if (const auto* spectrum = std::get_if<SampledSpectrum>(&property.value))
      found |= std::ranges::any_of(spectrum->samples, [](const auto& sample) { return sample.second > 1; });
  });
  return found;
}

}  // namespace

std::optional<Value> float_value(PbrtParameters& p, const std::string& name, double fallback, const PbrtNames& names) {
  const PbrtParameter* parameter = p.find(name);
  if (!parameter) return fallback;
  if (parameter->type != "texture") return p.get_float(name, fallback);
  const ObjectPtr texture = find_texture(p, *parameter, names.float_textures, "floats");
  return texture ? std::optional<Value>(texture) : std::nullopt;
}

std::optional<Value> spectrum_value(PbrtParameters& p, const std::string& name, const PbrtNames& names) {
  const PbrtParameter* parameter = p.find(name);
  if (!parameter) return std::nullopt;
  if (parameter->type == "texture") {
    const ObjectPtr texture = find_texture(p, *parameter, names.spectrum_textures, "spectra");
    return texture ? std::optional<Value>(texture) : std::nullopt;
  }
  if (parameter->type == "rgb") {
    const auto colour = rgb(p, *parameter);
    return colour ? std::optional<Value>(*colour) : std::nullopt;
  }
  if (parameter->type == "spectrum" && parameter->strings.empty()) {
    const auto spectrum = sampled(p, *parameter);
    return spectrum ? std::optional<Value>(*spectrum) : std::nullopt;
  }
  p.error_at(*parameter,
             parameter->type == "spectrum"
                 ? fmt::format("names the spectrum '{}', which is not supported here", parameter->strings[0])
                 : fmt::format("has the type '{}'; expected 'rgb', 'spectrum' or 'texture'", parameter->type));
  return std::nullopt;
}

std::optional<Value> reflectance_value(PbrtParameters& p, const std::string& name, const PbrtNames& names) {
  const std::optional<Value> value = spectrum_value(p, name, names);
  if (!value || !check_reflectance(p, name, *value)) return std::nullopt;
  const Value reflected = as_reflectance(*value, names);
  const ObjectPtr* texture = std::get_if<ObjectPtr>(&reflected);
  return texture && may_exceed_1(*texture) ? Value(scaled(p.where(), 1, *texture, 1.0)) : reflected;
}

Spectrum light_colour(PbrtParameters& p, const std::string& name) {
  const PbrtParameter* parameter = p.find(name);
  if (!parameter) return Spectrum(1);
  if (parameter->type == "rgb") {
    const auto colour = rgb(p, *parameter);
    return colour ? colour->rgb : Spectrum(1);
  }
  std::optional<SampledSpectrum> spectrum;
  if (parameter->type == "blackbody" && parameter->numbers.size() == 1 && parameter->numbers[0] > 0)
    spectrum = blackbody_spectrum(parameter->numbers[0], 1);
  else if (parameter->type == "spectrum" && parameter->strings == std::vector<std::string>{"stdillum-D65"})
    return Spectrum(1);
  else if (parameter->type == "spectrum" && parameter->strings.empty())
    spectrum = sampled(p, *parameter);
  else
    p.error_at(*parameter, "is not a light colour: expected 'rgb', 'blackbody' with a temperature, or 'spectrum'");
  if (!spectrum) return Spectrum(1);
  const Spectrum colour = spectrum_to_rgb(*spectrum, SpectrumRole::kEmission);
  const float y = luminance(colour);
  if (y > 0) return colour / y;
  p.error_at(*parameter, "is black");
  return Spectrum(1);
}

ObjectBuilder make_pbrt_texture(const std::string& type, PbrtParameters& p, PbrtNames& names) {
  if (type == "imagemap") return image_texture(p, names);
  if (type == "checkerboard") return checkerboard(p, names);
  if (type == "scale") return scaled_texture(p, names);
  if (type == "constant") {
    auto constant = make_object("texture", "uniform", p.where());
    const auto value = either(p, "value", 1, names);
    if (!value) return nullptr;
    set_property(*constant, "value", *value);
    return constant;
  }
  p.error("is not supported; supported: textures 'checkerboard', 'constant', 'imagemap' and 'scale'");
  return nullptr;
}

}  // namespace covary
