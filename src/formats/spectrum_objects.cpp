// SPDX-License-Identifier: Apache-2.0
#include "formats/spectrum_objects.h"

#include <fmt/format.h>

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

ColourValue colour(Parameters& p, const std::string& name) {
  return {p.get_spectrum(name, Spectrum(1), SpectrumRole::kEmission)};
}

const std::vector<std::string> kTypes = {"blackbody", "d65", "irregular", "regular", "rgb", "srgb", "uniform"};

Value read(const std::string& type, Parameters& p) {
  constexpr float kHuge = std::numeric_limits<float>::max();
  if (type == "uniform") return static_cast<double>(p.get_float("value", 1));
  if (type == "rgb") return colour(p, "value");
  if (type == "srgb") return colour(p, "color");
  if (type == "d65") {
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

Value spectrum_value(const ObjectPtr& object, Diagnostics& diagnostics) {
  if (std::find(kTypes.begin(), kTypes.end(), object->type) == kTypes.end()) {
    std::string list;
    for (const std::string& type : kTypes) list += (list.empty() ? "'" : ", '") + type + "'";
    diagnostics.error(object->where, fmt::format("unknown spectrum '{}'{}; supported: {}", object->type,
                                                 did_you_mean(object->type, kTypes), list));
    return ObjectPtr();
  }
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
