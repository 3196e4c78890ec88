// SPDX-License-Identifier: Apache-2.0
// Converts names and parameters of Mitsuba 0.x files to current ones (listed in docs/scene-format.md).
#include "formats/upgrade.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

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

/// eta and k were divided by the external index; in practice only "air" occurs.
void upgrade_conductor(ObjectDescription& object) {
  Property* const outside = find(object, "ext_eta");
  if (!outside) return;
  const std::string* name = std::get_if<std::string>(&outside->value);
  const auto value = number(outside);
  if ((value && std::abs(*value - 1) < 1e-3) || (name && (*name == "air" || *name == "vacuum")))
    remove(object, "ext_eta");
}

void drop(ObjectDescription& object, std::initializer_list<std::string_view> names, Diagnostics& diagnostics) {
  for (std::string_view name : names)
    if (const Property* property = find(object, name)) {
      diagnostics.warn(property->where, fmt::format("parameter '{}' of {} '{}' has no counterpart today and is ignored",
                                                    name, object.kind, object.type));
      remove(object, name);
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
  for (Property& property : object.properties) property.name = snake_case(property.name);
  upgrade_uv(object);
  if (object.kind == "bsdf") {
    if (object.type == "diffuse") rename(object, "diffuse_reflectance", "reflectance");
    if (object.type == "conductor" || object.type == "roughconductor") upgrade_conductor(object);
  } else if (object.kind == "texture") {
    if (object.type == "bitmap") upgrade_bitmap(object);
    if (object.type == "vertexcolors") object.type = "vertexcolor";
  } else if (object.kind == "film") {
    if (object.type == "ldrfilm") {
      diagnostics.warn(object.where, "film 'ldrfilm' is read as 'hdrfilm'");
      object.type = "hdrfilm";
      for (const char* name :
           {"gamma", "banner", "file_format", "pixel_format", "exposure", "tonemap_method", "key", "burn"})
        remove(object, name);
    }
    drop(object, {"attach_log"}, diagnostics);
  } else if (object.kind == "integrator") {
    drop(object, {"strict_normals"}, diagnostics);
  } else if (object.kind == "shape") {
    drop(object, {"collapse"}, diagnostics);
  }
}

}  // namespace covary
