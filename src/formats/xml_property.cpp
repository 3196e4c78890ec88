// SPDX-License-Identifier: Apache-2.0
#include "formats/xml_property.h"

#include <fmt/format.h>

#include <algorithm>

#include "formats/file_resolver.h"
#include "formats/xml_values.h"

namespace covary {
namespace {

Vec3 to_vec3(const std::vector<double>& v) {
  return {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])};
}

/// Any direction orthogonal to `d`.
Vec3 some_orthogonal(const Vec3& d) { return std::abs(d.x) > std::abs(d.y) ? Vec3{-d.z, 0, d.x} : Vec3{0, d.z, -d.y}; }

/// A scale that flattens one axis, which exporters write for planes, leaves a thickness far below the rounding errors
/// of the others instead of none, so that normals stay defined.
Vec3 thin(Vec3 scale) {
  const int n_zero = (scale.x == 0) + (scale.y == 0) + (scale.z == 0);
  for (int i = 0; i < 3 && n_zero == 1; ++i)
    if (scale[i] == 0) scale[i] = 1e-9f * std::max({std::abs(scale.x), std::abs(scale.y), std::abs(scale.z)});
  return scale;
}

Vec3 read_xyz(const XmlAttributes& attributes, const std::string& tag, double missing) {
  if (const std::string* value = attributes.find("value")) {
    if (attributes.find("x") || attributes.find("y") || attributes.find("z"))
      throw Error(ErrorCode::kInput, fmt::format("<{}> takes either value or x, y and z", tag));
    if (split_list(*value).size() == 1) return Vec3(to_vec3(std::vector<double>(3, parse_number(*value))));
    return to_vec3(parse_numbers(*value, 3));
  }
  std::vector<double> v(3, missing);
  for (int i = 0; i < 3; ++i)
    if (const std::string* text = attributes.find(i == 0 ? "x" : (i == 1 ? "y" : "z"))) v[i] = parse_number(*text);
  return to_vec3(v);
}

}  // namespace

const std::vector<std::string>& transform_tags() {
  static const std::vector<std::string> kTags = {"translate", "rotate",  "scale", "lookat",
                                                 "lookAt",    "look_at", "matrix"};
  return kTags;
}

Property PropertyReader::read(const XmlDocument& document, pugi::xml_node node) {
  const SourceLocation where = document.where(node);
  const std::string tag = node.name();
  std::string name = node.attribute("name").value();
  const auto read = [&](std::initializer_list<std::string_view> accepted) {
    XmlAttributes attributes(node, where, defines_, accepted, diagnostics_);
    name = attributes.get("name");
    if (!attributes.complete()) throw Error(ErrorCode::kInput, "");
    return attributes;
  };
  try {
    Value value;
    if (tag == "transform") {
      read({"!name"});
      value = read_transform(document, node);
    } else if (tag == "animation") {
      read({"!name"});
      value = read_animation(document, node);
    } else if (tag == "point" || tag == "vector") {
      const XmlAttributes attributes = read({"!name", "value", "x", "y", "z"});
      for (const char* axis : {"x", "y", "z"})
        if (!attributes.find("value") && !attributes.find(axis))
          throw Error(ErrorCode::kInput, fmt::format("<{}> needs x, y and z, or value", tag));
      value = read_xyz(attributes, tag, 0);
    } else if (tag == "blackbody") {
      const XmlAttributes attributes = read({"!name", "!temperature", "scale"});
      std::string temperature = attributes.get("temperature");
      if (temperature.ends_with('K') || temperature.ends_with('k')) temperature.pop_back();
      value = blackbody_spectrum(parse_number(temperature), parse_number(attributes.get("scale", "1")));
    } else if (tag == "spectrum") {
      value = read_spectrum(read({"!name", "value", "filename", "intent"}), where);
    } else if (tag == "rgb" || tag == "srgb") {
      const std::string text = read({"!name", "!value", "intent"}).get("value");
      value = tag == "rgb" ? parse_rgb(text) : parse_srgb(text);
    } else {
      const std::string text = read({"!name", "!value"}).get("value");
      if (tag == "boolean") value = parse_boolean(text);
      if (tag == "integer") value = parse_integer(text);
      if (tag == "float") value = parse_number(text);
      if (tag == "string") value = text;
    }
    return {name, std::move(value), where};
  } catch (const Error& error) {
    // An empty message means it was already recorded. The null object keeps the parameter known, but without a value.
    if (*error.what() != '\0')
      diagnostics_.error(where, name.empty() ? error.what() : fmt::format("'{}': {}", name, error.what()));
    return {name, ObjectPtr(), where};
  }
}

Value PropertyReader::read_spectrum(const XmlAttributes& attributes, const SourceLocation& where) {
  const std::string *value = attributes.find("value"), *filename = attributes.find("filename");
  if (!value == !filename) throw Error(ErrorCode::kInput, "<spectrum> takes either value or filename");
  if (value && old_)
    if (const auto triple = parse_spectrum_triple(*value)) return *triple;
  if (value) return parse_spectrum(*value);
  const std::string path = files_.resolve(*filename, where, diagnostics_);
  if (path.empty()) throw Error(ErrorCode::kInput, "");
  try {
    return parse_spectrum_file(FileView(path).text());
  } catch (const Error& error) {
    throw Error(ErrorCode::kInput, fmt::format("spectrum file '{}': {}", *filename, error.what()));
  }
}

Transform PropertyReader::read_transform(const XmlDocument& document, pugi::xml_node node) {
  Transform transform;
  for (const pugi::xml_node child : node.children()) {
    if (child.type() != pugi::node_element) continue;
    const SourceLocation where = document.where(child);
    const std::string tag = child.name();
    if (std::find(transform_tags().begin(), transform_tags().end(), tag) == transform_tags().end()) {
      diagnostics_.error(
          where, fmt::format("<{}> cannot stand inside <transform>{}", tag, did_you_mean(tag, transform_tags())));
      continue;
    }
    try {
      transform = read_operation(child, tag, where) * transform;
    } catch (const Error& error) {
      if (*error.what() != '\0') diagnostics_.error(where, fmt::format("<{}>: {}", tag, error.what()));
    }
  }
  return transform;
}

Value PropertyReader::read_animation(const XmlDocument& document, pugi::xml_node node) {
  std::vector<TransformKey> keys;
  for (const pugi::xml_node child : node.children()) {
    if (child.type() != pugi::node_element) continue;
    const SourceLocation where = document.where(child);
    if (std::string_view(child.name()) != "transform")
      throw Error(ErrorCode::kInput,
                  fmt::format("<{}> cannot stand inside <animation>, only <transform time=\"…\">", child.name()));
    const XmlAttributes attributes(child, where, defines_, {"!time"}, diagnostics_);
    if (!attributes.complete()) throw Error(ErrorCode::kInput, "");
    keys.push_back({parse_number(attributes.get("time")), read_transform(document, child).matrix()});
  }
  return std::make_shared<const KeyedTransform>(std::move(keys));
}

Transform PropertyReader::read_operation(pugi::xml_node node, const std::string& tag, const SourceLocation& where) {
  const auto read = [&](std::initializer_list<std::string_view> accepted) {
    XmlAttributes attributes(node, where, defines_, accepted, diagnostics_);
    if (!attributes.complete()) throw Error(ErrorCode::kInput, "");
    return attributes;
  };
  if (tag == "translate") return Transform::translate(read_xyz(read({"value", "x", "y", "z"}), tag, 0));
  if (tag == "scale") return Transform::scale(thin(read_xyz(read({"value", "x", "y", "z"}), tag, 1)));
  if (tag == "rotate") {
    const XmlAttributes attributes = read({"!angle", "value", "x", "y", "z"});
    const Vec3 axis = read_xyz(attributes, tag, 0);
    if (axis == Vec3{}) throw Error(ErrorCode::kInput, "the axis is zero");
    return Transform::rotate(axis, parse_number(attributes.get("angle")));
  }
  if (tag == "matrix") {
    const XmlAttributes attributes = read({"!value"});
    const std::string text = attributes.get("value");
    const size_t n = split_list(text).size();
    if (n != 16 && n != 9) throw Error(ErrorCode::kInput, fmt::format("{} values; expected 9 or 16", n));
    const std::vector<double> v = parse_numbers(text, n);
    Matrix4 m = Transform().matrix();
    const size_t side = n == 16 ? 4 : 3;
    for (size_t i = 0; i < n; ++i) m[i / side][i % side] = v[i];
    return Transform(m);
  }
  const XmlAttributes attributes = read({"!origin", "!target", "up"});
  const Vec3 origin = to_vec3(parse_numbers(attributes.get("origin"), 3));
  const Vec3 target = to_vec3(parse_numbers(attributes.get("target"), 3));
  Vec3 up;
  if (!attributes.get("up").empty()) up = to_vec3(parse_numbers(attributes.get("up"), 3));
  if (up == Vec3{}) up = some_orthogonal(target - origin);
  return Transform::look_at(origin, target, up);
}

}  // namespace covary
