// SPDX-License-Identifier: Apache-2.0
// Textures of pbrt-v4 (textures.cpp) and the names that version 3 has for their parameters.
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <functional>

#include "pbrt/pbrt_objects.h"

namespace covary {
namespace {

bool of_numbers(const PbrtParameters& p) { return p.what().starts_with("Texture \"float\""); }

bool has_extension(std::string name, std::initializer_list<const char*> extensions) {
  std::ranges::transform(name, name.begin(), [](unsigned char c) { return std::tolower(c); });
  return std::ranges::any_of(extensions, [&](const char* extension) { return name.ends_with(extension); });
}

/// Everything that a texture is made from.
struct Input {
  PbrtParameters& p;
  const Transform& to_world;
  PbrtNames& names;
};

/// `texture`, whose coordinates are (u, v) followed by `more`, at pbrt's coordinates.
ObjectBuilder mapped(const Input& in, const ObjectBuilder& texture, const Transform& more) {
  PbrtParameters& p = in.p;
  const std::string mapping = p.get_string("mapping", "uv");
  const auto number = [&](const char* name, double fallback) {
    return static_cast<float>(p.get_float(name, fallback));
  };
  const Vec3 scale{number("uscale", 1), number("vscale", 1), 1}, shift{number("udelta", 0), number("vdelta", 0), 0};
  if (mapping == "uv") {
    Transform stretch;
    if (scale.x != 0 && scale.y != 0)
      stretch = Transform::scale(scale);
    else
      p.error("has a scale of 0");
    set_property(*texture, "to_uv", more * Transform::translate(shift) * stretch);
    return texture;
  }
  if (mapping != "planar" && mapping != "cylindrical" && mapping != "spherical") {
    p.error(fmt::format("has the mapping '{}'; supported: 'uv', 'planar', 'cylindrical' and 'spherical'", mapping));
    return texture;
  }
  set_property(*texture, "to_uv", more);
  auto result = make_object("texture", "projected", p.where(), {{"mapping", mapping}, {"", ObjectPtr(texture)}});
  const Vec3 v1 = p.get_vec3("v1", {1, 0, 0}), v2 = p.get_vec3("v2", {0, 1, 0});
  if (mapping == "planar") {
    set_property(*result, "v1", v1);
    set_property(*result, "v2", v2);
    set_property(*result, "offset", shift);
  }
  const bool in_world = in.names.version_3 && mapping == "planar";  // which ignores transformations
  if (!in_world) set_property(*result, "to_world", in.to_world);
  return result;
}

/// A texture's input: a number, a colour or another texture.
std::optional<Value> either(const Input& in, const std::string& name, double fallback) {
  if (of_numbers(in.p)) return float_value(in.p, name, fallback, in.names);
  if (!in.p.has(name)) return fallback;
  if (in.p.find(name)->type == "float") return in.p.get_float(name, fallback);
  return spectrum_value(in.p, name, in.names);
}

/// The same object, if both are textures; other values are not compared.
bool same(const Value& a, const Value& b) {
  const ObjectPtr *first = std::get_if<ObjectPtr>(&a), *second = std::get_if<ObjectPtr>(&b);
  return !first || !second || *first == *second;
}

/// make(first, second), and, if pbrt looks up others for reflectances, the same of them.
ObjectBuilder of_two(const Input& in, const std::optional<Value>& first, const std::optional<Value>& second,
                     const std::function<ObjectBuilder(const Value&, const Value&)>& make) {
  if (!first || !second) return nullptr;
  const ObjectBuilder result = make(*first, *second);
  const Value a = as_reflectance(*first, in.names), b = as_reflectance(*second, in.names);
  if (!same(a, *first) || !same(b, *second)) in.names.reflectances[result] = make(a, b);
  return result;
}

ObjectBuilder inverted(const SourceLocation& where, const ObjectPtr& texture) {
  return make_object("texture", "mix", where, {{"first", 1.0}, {"second", 0.0}, {"amount", texture}});
}

/// How integers are decoded. pbrt reads the encoding of PNG files alone: other integers are sRGB, floats linear
/// (image.cpp: Image::Read). Version 3 has a switch, `gamma`, for all files.
void set_encoding(const Input& in, ObjectDescription& bitmap, const std::string& filename) {
  PbrtParameters& p = in.p;
  std::string encoding = p.get_string("encoding", "sRGB");
  if (const PbrtParameter* gamma = p.find("gamma"); gamma && gamma->type == "bool")
    encoding = p.get_bool("gamma", true) ? "sRGB" : "linear";
  else if (gamma)
    encoding = fmt::format("gamma {}", p.get_float("gamma", 1));
  const bool free = in.names.version_3 || has_extension(filename, {".png"});
  set_property(bitmap, "raw", free && encoding == "linear");
  if (encoding == "sRGB" || encoding == "linear") return;
  const double power = encoding.starts_with("gamma ") ? std::strtod(encoding.c_str() + 6, nullptr) : 0;
  if (!(power > 0 && power <= 10))
    p.error(fmt::format("has encoding '{}'; supported: 'sRGB', 'linear' and 'gamma X'", encoding));
  else if (free)
    set_property(bitmap, "gamma", power);
}

ObjectBuilder image_texture(const Input& in) {
  PbrtParameters& p = in.p;
  const std::string filename = p.get_string("filename", "");
  auto bitmap = make_object("texture", "bitmap", p.where(), {{"filename", filename}});
  const std::string filter = p.get_string("filter", "bilinear");
  std::string wrap = p.get_string("wrap", "repeat");
  if (wrap == "octahedralsphere") {
    p.warn("wraps around an octahedron in pbrt; here its edges are repeated");
    wrap = "clamp";
  }
  if (wrap == "repeat" || wrap == "clamp" || wrap == "black")
    set_property(*bitmap, "wrap_mode", wrap);
  else
    p.error(fmt::format("has wrap '{}'; supported: 'repeat', 'clamp' and 'black'", wrap));
  set_property(*bitmap, "filter_type", std::string(filter == "point" ? "nearest" : "bilinear"));
  p.ignore({"maxanisotropy", "trilinear"});
  set_encoding(in, *bitmap, filename);
  if (of_numbers(p) && !in.names.version_3) set_property(*bitmap, "grey", std::string("alpha_or_mean"));
  // pbrt's v = 0 is the bottom of the image.
  const ObjectBuilder image = mapped(in, bitmap, Transform::translate({0, 1, 0}) * Transform::scale({1, -1, 1}));
  const double scale = p.get_float("scale", 1);
  const ObjectBuilder texture = scale == 1 ? image : scaled_texture(p.where(), scale, image);
  if (p.get_bool("invert", false)) return inverted(p.where(), texture);
  if (scale > 1 || has_extension(filename, {".exr", ".pfm", ".hdr"}))  // pbrt clamps images used as reflectances
    in.names.reflectances[texture] = scaled_texture(p.where(), scale, image, 1.0);
  return texture;
}

ObjectBuilder checkerboard(const Input& in) {
  const bool solid = in.p.get_integer("dimension", 2) == 3;
  in.p.ignore({"aamode"});
  return of_two(in, either(in, "tex1", 1), either(in, "tex2", 0), [&](const Value& first, const Value& second) {
    auto board = make_object("texture", "checkerboard", in.p.where(), {{"color0", first}, {"color1", second}});
    // pbrt's squares have side 1, ours 1/2.
    if (!solid) return mapped(in, board, Transform::scale({0.5f, 0.5f, 1}));
    set_property(*board, "dimension", int64_t{3});
    set_property(*board, "to_world", in.to_world);
    return board;
  });
}

ObjectBuilder dots(const Input& in) {
  return of_two(in, either(in, "inside", 1), either(in, "outside", 0), [&](const Value& first, const Value& second) {
    return mapped(in, make_object("texture", "dots", in.p.where(), {{"inside", first}, {"outside", second}}), {});
  });
}

ObjectBuilder product(const Input& in) {
  in.p.rename("tex1", "tex"), in.p.rename("tex2", "scale");
  const auto make = [&](const Value& first, const Value& second) {
    const Value *texture = &first, *factor = &second;
    if (!std::holds_alternative<ObjectPtr>(first)) std::swap(texture, factor);
    if (const ObjectPtr* object = std::get_if<ObjectPtr>(texture))
      return scaled_texture(in.p.where(), *factor, *object);
    return scaled_texture(in.p.where(), second, make_object("texture", "uniform", in.p.where(), {{"value", first}}));
  };
  std::optional<Value> factor = 1.0;
  if (const PbrtParameter* scale = in.p.find("scale")) {
    const bool number = scale->type == "float" ||
                        (scale->type == "texture" && !of_numbers(in.p) &&
                         in.names.find(PbrtKind::kFloatTexture, scale->strings.at(0), in.p.order()) != nullptr);
    factor = number ? float_value(in.p, "scale", 1, in.names) : either(in, "scale", 1);
  }
  return of_two(in, either(in, "tex", 1), factor, make);
}

ObjectBuilder mixture(const Input& in, bool by_direction) {
  const auto amount = by_direction ? Value(0.0) : float_value(in.p, "amount", 0.5, in.names);
  if (!amount) return nullptr;
  const Vec3 direction = in.to_world.vector(in.p.get_vec3("dir", {0, 1, 0}));
  return of_two(in, either(in, "tex1", 0), either(in, "tex2", 1), [&](const Value& first, const Value& second) {
    auto mix = make_object("texture", "mix", in.p.where());
    set_property(*mix, by_direction ? "second" : "first", first);
    set_property(*mix, by_direction ? "first" : "second", second);
    if (by_direction)
      set_property(*mix, "direction", direction);
    else
      set_property(*mix, "amount", *amount);
    return mix;
  });
}

ObjectBuilder noise(const Input& in, const std::string& pattern) {
  auto texture = make_object("texture", "noise", in.p.where(), {{"pattern", pattern}, {"to_world", in.to_world}});
  if (pattern != "windy") {
    set_property(*texture, "octaves", in.p.get_integer("octaves", 8));
    set_property(*texture, "roughness", in.p.get_float("roughness", 0.5));
  }
  if (pattern != "marble") return texture;
  set_property(*texture, "scale", in.p.get_float("scale", 1));
  set_property(*texture, "variation", in.p.get_float("variation", 0.2));
  return texture;
}

ObjectBuilder bilerp(const Input& in) {
  auto texture = make_object("texture", "bilerp", in.p.where());
  for (const char* name : {"v00", "v01", "v10", "v11"}) {
    const auto value = either(in, name, name[2] == '1' ? 1 : 0);
    if (!value) return nullptr;
    set_property(*texture, name, *value);
  }
  return mapped(in, texture, {});
}

/// Version 3: the fractions of the coordinates as red and green.
ObjectBuilder coordinates(const Input& in) {
  auto texture = make_object("texture", "bilerp", in.p.where(),
                             {{"v00", ColourValue{{0, 0, 0}}},
                              {"v10", ColourValue{{1, 0, 0}}},
                              {"v01", ColourValue{{0, 1, 0}}},
                              {"v11", ColourValue{{1, 1, 0}}},
                              {"repeat", true}});
  return mapped(in, texture, {});
}

}  // namespace

ObjectBuilder scaled_texture(const SourceLocation& where, const Value& scale, const ObjectPtr& texture,
                             std::optional<double> maximum) {
  auto result = make_object("texture", "scale", where, {{"scale", scale}, {"", texture}});
  if (maximum) set_property(*result, "maximum", *maximum);
  return result;
}

ObjectBuilder make_pbrt_texture(const std::string& type, PbrtParameters& p, const Transform& to_world,
                                PbrtNames& names) {
  const Input in{p, to_world, names};
  if (type == "imagemap") return image_texture(in);
  if (type == "checkerboard") return checkerboard(in);
  if (type == "dots") return dots(in);
  if (type == "scale") return product(in);
  if (type == "mix" || type == "directionmix") return mixture(in, type == "directionmix");
  if (type == "fbm" || type == "wrinkled" || type == "windy" || type == "marble") return noise(in, type);
  if (type == "bilerp") return bilerp(in);
  if (type == "uv") return coordinates(in);
  if (type == "constant") {
    const auto value = either(in, "value", 1);
    if (!value) return nullptr;
    return make_object("texture", "uniform", p.where(), {{"value", *value}});
  }
  if (type == "ptex") {
    p.error(
        "has colours for each face of its mesh (Ptex), which is not supported, and whose mean colour is not known; use "
        "'imagemap' or 'constant' instead");
    p.ignore_all();
    return nullptr;
  }
  p.unsupported(
      "textures 'bilerp', 'checkerboard', 'constant', 'directionmix', 'dots', 'fbm', "
      "'imagemap', 'marble', 'mix', 'scale', 'windy' and 'wrinkled'");
  return nullptr;
}

}  // namespace covary
