// SPDX-License-Identifier: Apache-2.0
#include "formats/spectrum_objects.h"

#include <algorithm>

#include "formats/object_builder.h"
#include "formats/xml_values.h"

namespace covary {
namespace {

/// For spectra, which have no nested objects.
class NoObjects final : public ObjectFactory {
 public:
  std::shared_ptr<const SceneObject> make(const ObjectPtr&) override { return nullptr; }
  std::optional<std::string> resolve_file(const std::string&, const SourceLocation&) override { return std::nullopt; }
};

std::vector<double> numbers(Parameters& p, const std::string& name) {
  const std::string text = p.require_string(name);
  std::vector<double> result;
  for (std::string_view token : split_list(text)) result.push_back(parse_number(token));
  return result;
}

/// The vector of a writer that knows three numbers but no colours is one.
ColourValue colour(Parameters& p, const std::string& name) {
  for (const Property& property : p.object().properties)
    if (const Vec3* v = std::get_if<Vec3>(&property.value); v && property.name == name)
      return p.get_vec3(name, {}), ColourValue{{v->x, v->y, v->z}};
  return {p.get_spectrum(name, Spectrum(1), SpectrumRole::kEmission)};
}

/// The nested texture, if any.
const Property* texture_of(const ObjectDescription& object) {
  for (const Property& property : object.properties)
    if (const ObjectPtr* child = std::get_if<ObjectPtr>(&property.value))
      if (*child && (*child)->kind == "texture") return &property;
  return nullptr;
}

/// d65 times a texture is the texture here: D65 is the white of linear RGB.
Value scaled_texture(Parameters& p, const Property& texture) {
  p.holds_object(texture.name);
  const float scale = p.get_float("scale", 1);
  if (scale == 1) return texture.value;
  return ObjectPtr(
      make_object("texture", "scale", p.object().where, {{"", texture.value}, {"scale", static_cast<double>(scale)}}));
}

const std::vector<std::string> kTypes = {"blackbody", "d65", "irregular", "regular", "rgb", "srgb", "uniform"};

Value read(const std::string& type, Parameters& p) {
  constexpr float kHuge = std::numeric_limits<float>::max();
  if (type == "uniform") return static_cast<double>(p.get_float("value", 1));
  if (type == "rgb") return colour(p, "value");
  if (type == "srgb") return colour(p, "color");
  if (type == "d65") {
    if (const Property* texture = texture_of(p.object())) return scaled_texture(p, *texture);
    const ColourValue base = colour(p, "color");
    return ColourValue{base.rgb * p.get_float("scale", 1)};
  }
  if (type == "blackbody") {
    if (!p.has("temperature")) throw Error(ErrorCode::kInput, "the float 'temperature' is missing");
    const float temperature = p.get_float("temperature", 5000, 0, kHuge);
    return blackbody_spectrum(temperature, p.get_float("scale", 1));
  }
  if (type == "irregular") {
    const std::vector<double> wavelengths = numbers(p, "wavelengths");
    return make_spectrum(wavelengths, numbers(p, "values"));
  }
  const float first = p.get_float("wavelength_min", 360, 0, kHuge), last = p.get_float("wavelength_max", 830, 0, kHuge);
  const std::vector<double> values = numbers(p, "values");
  std::vector<double> wavelengths;
  for (size_t i = 0; i < values.size(); ++i)
    wavelengths.push_back(first + (last - first) * static_cast<double>(i) /
                                      static_cast<double>(std::max<size_t>(values.size() - 1, 1)));
  return make_spectrum(wavelengths, values);
}

}  // namespace

const std::vector<std::string>& spectrum_types() { return kTypes; }

bool is_spectrum_type(std::string_view type) { return std::find(kTypes.begin(), kTypes.end(), type) != kTypes.end(); }

Value spectrum_value(const ObjectPtr& object, Diagnostics& diagnostics) {
  NoObjects factory;
  Parameters parameters(*object, factory, diagnostics);
  try {
    Value value = read(object->type, parameters);
    parameters.report_unknown();
    return value;
  } catch (const Error& error) {
    parameters.error(error.what());
    return ObjectPtr();
  }
}

}  // namespace covary
