// SPDX-License-Identifier: Apache-2.0
// Converts names and parameters of Mitsuba 0.x files to current ones (listed in docs/scene-format.md).
#include "formats/upgrade.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "formats/xml_values.h"

namespace covary {
namespace {

bool is_lower(char c) { return c >= 'a' && c <= 'z'; }
bool is_upper(char c) { return c >= 'A' && c <= 'Z'; }
char to_lower(char c) { return is_upper(c) ? static_cast<char>(c - 'A' + 'a') : c; }

Property* find(ObjectDescription& object, std::string_view name) {
  for (Property& property : object.properties)
    if (property.name == name) return &property;
  return nullptr;
}

void remove(ObjectDescription& object, std::string_view name) {
  std::erase_if(object.properties, [&](const Property& p) { return p.name == name; });
}

void rename(ObjectDescription& object, std::string_view from, const std::string& to) {
  if (find(object, to)) return;
  if (Property* property = find(object, from)) property->name = to;
}

/// The property's number, if it is one.
std::optional<double> number(const Property* property) {
  if (!property) return std::nullopt;
  if (const double* value = std::get_if<double>(&property->value)) return *value;
  if (const int64_t* value = std::get_if<int64_t>(&property->value)) return static_cast<double>(*value);
  return std::nullopt;
}

/// uoffset, voffset, uscale, vscale -> to_uv.
void upgrade_uv(ObjectDescription& object) {
  Matrix4 m = Transform().matrix();
  bool found = false;
  SourceLocation where;
  for (int axis = 0; axis < 2; ++axis) {
    const std::string prefix = axis == 0 ? "u" : "v";
    Property* const offset = find(object, prefix + "offset");
    Property* const scale = find(object, prefix + "scale");
    if (offset || scale) found = true, where = (scale ? scale : offset)->where;
    const double factor = number(scale).value_or(1);
    m[axis][axis] = factor;
    m[axis][3] = factor * number(offset).value_or(0);
    if (!offset || number(offset)) remove(object, prefix + "offset");
    if (!find(object, prefix + "scale") || number(find(object, prefix + "scale"))) remove(object, prefix + "scale");
  }
  if (found && !find(object, "to_uv")) object.properties.push_back({"to_uv", Transform(m), where});
}

void upgrade_bitmap(ObjectDescription& object) {
  if (Property* filter = find(object, "filter_type"))
    if (std::string* value = std::get_if<std::string>(&filter->value))
      if (*value == "ewa" || *value == "trilinear") *value = "bilinear";
  if (const auto gamma = number(find(object, "gamma"))) {
    // 1: the file holds linear values; 2.2 or -1: sRGB, the default.
    Property* property = find(object, "gamma");
    if (*gamma == 1) {
      *property = {"raw", true, property->where};
    } else if (std::abs(*gamma - 2.2) < 1e-3 || *gamma == -1) {
      remove(object, "gamma");
    }
  }
  remove(object, "max_anisotropy");
  remove(object, "cache");
}

/// Mitchell's B and C are called A and B today.
void upgrade_mitchell(ObjectDescription& object) {
  if (!find(object, "C")) return;
  rename(object, "B", "A");
  rename(object, "C", "B");
}

/// Media whose density is a volume, and volumes that know their place.
void upgrade_volume(ObjectDescription& object) {
  if (object.kind == "medium") {
    rename(object, "density", "sigma_t");
    for (const char* name : {"method", "step_size"}) remove(object, name);
  } else if (object.type == "gridvolume") {
    remove(object, "send_data");
    if (!find(object, "use_grid_bbox")) object.properties.push_back({"use_grid_bbox", true, object.where});
  }
}

void upgrade_film(ObjectDescription& object, Diagnostics& diagnostics) {
  if (object.type == "ldrfilm") {
    diagnostics.warn(object.where, "film 'ldrfilm' is read as 'hdrfilm'");
    object.type = "hdrfilm";
    for (const char* name :
         {"gamma", "banner", "file_format", "pixel_format", "exposure", "tonemap_method", "key", "burn"})
      remove(object, name);
  } else if (object.type == "mfilm") {
    diagnostics.warn(object.where, "film 'mfilm' is read as 'hdrfilm'");
    object.type = "hdrfilm";
    for (const char* name : {"digits", "variable", "file_format", "pixel_format"}) remove(object, name);
  } else if (object.type == "tiledhdrfilm") {
    object.type = "hdrfilm";
  }
  // "luminanceAlpha", or one format for each of several channels.
  if (Property* format = find(object, "pixel_format"))
    if (std::string* text = std::get_if<std::string>(&format->value))
      *text = text->find_first_of(", ") == std::string::npos ? snake_case(*text) : "multichannel";
}

/// eta and k were divided by the external index; in practice only "air" occurs.
void upgrade_conductor(ObjectDescription& object) {
  Property* const outside = find(object, "ext_eta");
  if (!outside) return;
  const std::string* name = std::get_if<std::string>(&outside->value);
  const auto value = number(outside);
  if ((value && std::abs(*value - 1) < 1e-3) || (name && (*name == "air" || *name == "vacuum")))
    remove(object, "ext_eta");
}

/// The cosine lobes of Phong and of Ashikhmin and Shirley, with a roughness that makes them like Beckmann's.
void upgrade_distribution(ObjectDescription& object, Diagnostics& diagnostics) {
  Property* property = find(object, "distribution");
  std::string* name = property ? std::get_if<std::string>(&property->value) : nullptr;
  if (!name || (*name != "phong" && *name != "as")) return;
  diagnostics.warn(property->where,
                   fmt::format("the distribution '{}' of bsdf '{}' is read as 'beckmann', to which its "
                               "roughness makes it similar",
                               *name, object.type));
  *name = "beckmann";
}

/// `sky`, `sun` and `sunsky`. In Mitsuba 0.x, y is up, x points east and z south; in Mitsuba 3, z is up, x points south
/// and y west.
void upgrade_sky(ObjectDescription& object, Diagnostics& diagnostics) {
  static const Transform kAxes(Matrix4{{{0, -1, 0, 0}, {0, 0, 1, 0}, {1, 0, 0, 0}, {0, 0, 0, 1}}});
  if (Property* to_world = find(object, "to_world")) {
    if (const Transform* placed = std::get_if<Transform>(&to_world->value)) to_world->value = *placed * kAxes;
  } else {
    object.properties.push_back({"to_world", kAxes, object.where});
  }
  const auto set_default = [&](const char* name, double value) {
    if (!find(object, name)) object.properties.push_back({name, value, object.where});
  };
  const double scale = number(find(object, "scale")).value_or(1);
  set_default("sun_scale", object.type == "sky" ? 0 : scale);
  set_default("sky_scale", object.type == "sun" ? 0 : scale);
  set_default("albedo", 0.15);
  if (const Property* radius = find(object, "sun_radius_scale"); number(radius))  // 0: parallel light
    set_default("sun_aperture", std::max(0.5358 * *number(radius), 1e-3));
  if (number(find(object, "stretch")) == 1.0) remove(object, "stretch");
  for (const char* name : {"resolution", "scale", "sun_radius_scale"}) remove(object, name);
  if (object.type != "sky")
    diagnostics.warn(object.where, fmt::format("the sun of emitter '{}' is that of Mitsuba 3; Mitsuba 0.x has another "
                                               "model of its colour and brightness",
                                               object.type));
  object.type = "sunsky";
}

void drop(ObjectDescription& object, std::initializer_list<std::string_view> names, Diagnostics& diagnostics) {
  for (std::string_view name : names)
    if (const Property* property = find(object, name)) {
      diagnostics.warn(property->where, fmt::format("parameter '{}' of {} '{}' has no counterpart today and is ignored",
                                                    name, object.kind, object.type));
      remove(object, name);
    }
}

/// Mitsuba 0.x scales colours above 1 down to conserve energy.
void conserve_energy(ObjectDescription& object, Diagnostics& diagnostics) {
  for (Property& property : object.properties) {
    ColourValue* colour = std::get_if<ColourValue>(&property.value);
    if (!colour || !(property.name.ends_with("reflectance") || property.name.ends_with("transmittance"))) continue;
    const float most = max_component(colour->rgb);
    if (!(most > 1 && std::isfinite(most))) continue;
    diagnostics.warn(property.where, fmt::format("parameter '{}' of bsdf '{}' is {:.4g} times too bright: it is scaled "
                                                 "down, as in Mitsuba 0.x",
                                                 property.name, object.type, most));
    colour->rgb = colour->rgb / most;
  }
}

}  // namespace

std::string snake_case(std::string_view name) {
  std::string result;
  for (size_t i = 0; i < name.size(); ++i) {
    if (i > 0 && is_lower(name[i - 1]) && is_upper(name[i])) {
      result += '_';
      while (i < name.size() && is_upper(name[i])) result += to_lower(name[i++]);
      --i;
    } else {
      result += name[i];
    }
  }
  return result;
}

void upgrade_object(ObjectDescription& object, Diagnostics& diagnostics) {
  for (char& c : object.type) c = to_lower(c);  // on Windows, the case of a plugin's name did not matter
  for (Property& property : object.properties) property.name = snake_case(property.name);
  upgrade_uv(object);
  if (object.kind == "bsdf") {
    upgrade_distribution(object, diagnostics);
    conserve_energy(object, diagnostics);
    if (object.type == "diffuse") rename(object, "diffuse_reflectance", "reflectance");
    if (object.type == "conductor" || object.type == "roughconductor") upgrade_conductor(object);
  } else if (object.kind == "texture") {
    if (object.type == "bitmap") upgrade_bitmap(object);
    if (object.type == "vertexcolors") object.type = "vertexcolor";
  } else if (object.kind == "film") {
    upgrade_film(object, diagnostics);
    drop(object, {"attach_log"}, diagnostics);
  } else if (object.kind == "emitter" && (object.type == "sky" || object.type == "sun" || object.type == "sunsky")) {
    upgrade_sky(object, diagnostics);
  } else if (object.kind == "rfilter" && object.type == "mitchell") {
    upgrade_mitchell(object);
  } else if (object.kind == "medium" || object.kind == "volume") {
    upgrade_volume(object);
  } else if (object.kind == "integrator") {
    drop(object, {"light_image", "sample_direct", "strict_normals"}, diagnostics);
  } else if (object.kind == "shape") {
    drop(object, {"collapse"}, diagnostics);
  }
}

namespace {

/// The numbers of `weights`, one for each nested model; empty after recording an error.
std::vector<double> mixture_weights(const ObjectDescription& object, size_t n, Diagnostics& diagnostics) {
  const auto fail = [&](const std::string& message) {
    diagnostics.error(object.where, "bsdf 'mixturebsdf': " + message);
    return std::vector<double>();
  };
  const auto property = std::find_if(object.properties.begin(), object.properties.end(),
                                     [](const Property& p) { return p.name == "weights"; });
  const std::string* text = property == object.properties.end() ? nullptr : std::get_if<std::string>(&property->value);
  if (!text) return fail("the string 'weights' is missing");
  try {
    std::vector<double> weights = parse_numbers(*text, n);
    const double sum = std::accumulate(weights.begin(), weights.end(), 0.0);
    if (weights.empty() || !(sum > 0) || *std::min_element(weights.begin(), weights.end()) < 0)
      return fail("its weights must not be negative, nor all 0");
    if (sum > 1)  // as Mitsuba 0.6 does to conserve energy
      for (double& weight : weights) weight /= sum;
    return weights;
  } catch (const Error& error) {
    return fail(fmt::format("of {} nested models: weights {}", n, error.what()));
  }
}

}  // namespace

void expand_mixture(ObjectDescription& object, std::vector<std::shared_ptr<ObjectDescription>>& objects,
                    Diagnostics& diagnostics) {
  std::vector<Property> nested;
  for (const Property& property : object.properties)
    if (std::holds_alternative<ObjectPtr>(property.value)) nested.push_back(property);
  const std::vector<double> weights = mixture_weights(object, nested.size(), diagnostics);
  // From the last model up, each is blended with the mixture of those before it; less than 1 in all is black.
  const auto make = [&](const char* type, std::vector<Property> properties) {
    auto made = std::make_shared<ObjectDescription>();
    made->kind = "bsdf", made->type = type, made->where = object.where, made->properties = std::move(properties);
    objects.push_back(made);
    return Property{"", ObjectPtr(made), object.where};
  };
  const auto parts = [&](const Property& first, const Property& second, double weight) {
    std::vector<Property> properties{first, second, {"weight", weight, object.where}};
    properties[0].name = properties[1].name = "";
    return properties;
  };
  object.type = "blendbsdf";
  if (weights.empty()) {
    object.type = "diffuse", object.properties.clear();  // the error is recorded
    return;
  }
  const double rest = 1 - std::accumulate(weights.begin(), weights.end(), 0.0);
  double sum = rest > 1e-6 ? rest : 0;
  Property mixed = sum > 0 ? make("diffuse", {{"reflectance", 0.0, object.where}}) : nested[0];
  size_t i = sum > 0 ? 0 : 1;
  if (i == 1) sum = weights[0];
  if (i == nested.size()) {  // one model with all the weight
    object.properties = parts(nested[0], nested[0], 0);
    return;
  }
  for (; i < nested.size(); ++i) {
    sum += weights[i];
    std::vector<Property> both = parts(mixed, nested[i], sum > 0 ? weights[i] / sum : 0);
    if (i + 1 == nested.size())
      object.properties = std::move(both);
    else
      mixed = make("blendbsdf", std::move(both));
  }
}

}  // namespace covary
