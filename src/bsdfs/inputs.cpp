// SPDX-License-Identifier: Apache-2.0
#include "bsdfs/inputs.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <algorithm>
#include <cctype>

#include "bsdfs/conductor_presets.h"
#include "bsdfs/roughness.h"

namespace covary {
namespace {

struct NamedIor {
  const char* name;
  float ior;
};
// Hecht, "Optics", 4th edition; Mitsuba's names.
constexpr NamedIor kNamedIors[] = {
    {"vacuum", 1.0f},      {"helium", 1.000036f},        {"hydrogen", 1.000132f},
    {"air", 1.000277f},    {"carbon dioxide", 1.00045f}, {"water", 1.333f},
    {"acetone", 1.36f},    {"ethanol", 1.361f},          {"carbon tetrachloride", 1.461f},
    {"glycerol", 1.4729f}, {"benzene", 1.501f},          {"silicone oil", 1.52045f},
    {"bromine", 1.661f},   {"water ice", 1.31f},         {"fused quartz", 1.458f},
    {"pyrex", 1.47f},      {"acrylic glass", 1.49f},     {"polypropylene", 1.49f},
    {"bk7", 1.5046f},      {"sodium chloride", 1.544f},  {"amber", 1.55f},
    {"pet", 1.575f},       {"diamond", 2.419f},
};

const NamedIor* find_named_ior(std::string name) {
  std::transform(name.begin(), name.end(), name.begin(), [](unsigned char c) { return std::tolower(c); });
  const auto* found = std::find_if(std::begin(kNamedIors), std::end(kNamedIors),
                                   [&](const NamedIor& entry) { return name == entry.name; });
  return found == std::end(kNamedIors) ? nullptr : found;
}

bool is_string(const Parameters& parameters, const std::string& name) {
  for (const Property& property : parameters.object().properties)
    if (property.name == name) return std::holds_alternative<std::string>(property.value);
  return false;
}

}  // namespace

float get_ior(Parameters& parameters, const std::string& name, const std::string& fallback) {
  const float fallback_ior = find_named_ior(fallback)->ior;
  if (!is_string(parameters, name)) return parameters.get_float(name, fallback_ior, 0.01f, 100.0f);
  const std::string value = parameters.get_string(name, fallback);
  if (const NamedIor* entry = find_named_ior(value)) return entry->ior;
  std::vector<std::string> names;
  std::string list;
  for (const NamedIor& entry : kNamedIors) {
    names.push_back(entry.name);
    list += (list.empty() ? "" : ", ") + names.back();
  }
  parameters.error_at(name, fmt::format("is the unknown material '{}'; expected a number in [0.01, 100] or one of {}{}",
                                        value, list, did_you_mean(value, names)));
  return fallback_ior;
}

float get_relative_ior(Parameters& parameters, const std::string& interior) {
  const float int_ior = get_ior(parameters, "int_ior", interior);
  return int_ior / get_ior(parameters, "ext_ior", "air");
}

ConductorInput get_conductor(Parameters& parameters) {
  const bool has_eta = parameters.has("eta"), has_k = parameters.has("k");
  const std::string material = parameters.get_string("material", "none");
  if (material != "none" && (has_eta || has_k))
    parameters.error_at("material",
                        fmt::format("is '{}' together with 'eta' or 'k'; expected one or the other", material));
  const auto constant = [](const Spectrum& value) { return ColourInput(std::make_shared<ConstantTexture>(value)); };
  if (material != "none" && !has_eta && !has_k) {
    if (const ConductorPreset* preset = find_conductor_preset(material))
      return {constant(preset->eta), constant(preset->k)};
    const std::vector<std::string> names = conductor_preset_names();
    parameters.error_at("material", fmt::format("is the unknown conductor '{}'; expected one of none, {}{}", material,
                                                fmt::join(names, ", "), did_you_mean(material, names)));
  }
  // eta = 0, k = 1 reflects everything at every angle.
  return {ColourInput(parameters.get_texture("eta", Spectrum(0), SpectrumRole::kIndex)),
          ColourInput(parameters.get_texture("k", Spectrum(1), SpectrumRole::kIndex))};
}

RoughnessInput get_roughness(Parameters& parameters) {
  const MicrofacetType type = parameters.get_choice("distribution", "beckmann", {"beckmann", "ggx"}) == "ggx"
                                  ? MicrofacetType::kGgx
                                  : MicrofacetType::kBeckmann;
  const bool sample_visible = parameters.get_bool("sample_visible", true);
  const bool has_u = parameters.has("alpha_u"), has_v = parameters.has("alpha_v");
  if (has_u != has_v)
    parameters.error_at(has_u ? "alpha_u" : "alpha_v", "is given alone; expected both 'alpha_u' and 'alpha_v'");
  if ((has_u || has_v) && parameters.has("alpha"))
    parameters.error_at("alpha", "is given together with 'alpha_u' or 'alpha_v'; expected one or the other");
  const auto get = [&](const char* name) {
    return NumberInput(parameters.get_texture(name, Spectrum(0.1f), SpectrumRole::kIndex));
  };
  if (has_u || has_v) return {type, get("alpha_u"), get("alpha_v"), sample_visible, true};
  NumberInput alpha = get("alpha");
  return {type, alpha, alpha, sample_visible, false};
}

std::vector<BsdfPtr> get_nested_bsdfs(Parameters& parameters, size_t least, size_t most) {
  size_t n_described = 0;
  for (const Property& property : parameters.object().properties)
    if (const ObjectPtr* object = std::get_if<ObjectPtr>(&property.value)) {
      if (!*object) return {};  // unresolved reference, already reported
      if ((*object)->kind == "bsdf") ++n_described;
    }
  std::vector<BsdfPtr> nested = parameters.children<Bsdf>("bsdf");
  if (n_described < least || n_described > most) {
    parameters.error(
        fmt::format("has {} nested reflectance models; it takes {}", n_described,
                    least == most ? fmt::format("exactly {}", least) : fmt::format("{} or {}", least, most)));
    return {};
  }
  // A nested model that could not be created has reported its own error.
  if (nested.size() != n_described) return {};
  return nested;
}

}  // namespace covary
