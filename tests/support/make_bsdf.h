// SPDX-License-Identifier: Apache-2.0
// BSDFs for tests, made from dictionaries like those of Mitsuba's load_dict:
//     make_bsdf({{"type", "plastic"}, {"int_ior", 1.9}, {"diffuse_reflectance", rgb(0.1, 0.2, 0.3)}})
// A dictionary whose type is not that of a BSDF is a texture; textures are given by the name of their type.
#pragma once

#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "bsdfs/registry.h"
#include "scene/parameters.h"

namespace covary::testing {

using Json = nlohmann::ordered_json;

inline Json rgb(double r, double g, double b) { return {{"type", "rgb"}, {"value", {r, g, b}}}; }

inline const Plugin<Bsdf>* find_plugin(const std::string& type) {
  for (const Plugin<Bsdf>& plugin : bsdf_plugins())
    if (type == plugin.name) return &plugin;
  return nullptr;
}

inline ObjectPtr describe(const Json& dictionary) {
  auto object = std::make_shared<ObjectDescription>();
  object->type = dictionary.at("type");
  object->kind = find_plugin(object->type) ? "bsdf" : "texture";
  for (const auto& [name, value] : dictionary.items()) {
    if (name == "type") continue;
    Property property{name, Value{}, {}};
    if (value.is_boolean())
      property.value = value.get<bool>();
    else if (value.is_number_integer())
      property.value = value.get<int64_t>();
    else if (value.is_number())
      property.value = value.get<double>();
    else if (value.is_string())
      property.value = value.get<std::string>();
    else if (value.at("type") == "rgb") {
      const Json& c = value.at("value");
      property.value = ColourValue{{c.at(0).get<float>(), c.at(1).get<float>(), c.at(2).get<float>()}};
    } else
      property.value = describe(value);
    object->properties.push_back(std::move(property));
  }
  return object;
}

/// Makes nested BSDFs through the registry and returns given textures by type name.
class TestFactory final : public ObjectFactory {
 public:
  TestFactory(std::map<std::string, TexturePtr> textures, Diagnostics& diagnostics)
      : textures_(std::move(textures)), diagnostics_(diagnostics) {}

  std::shared_ptr<const SceneObject> make(const ObjectPtr& description) override {
    if (description->kind == "texture") return textures_.at(description->type);
    Parameters parameters(*description, *this, diagnostics_);
    std::shared_ptr<const SceneObject> object = find_plugin(description->type)->make(parameters);
    parameters.report_unknown();
    return object;
  }
  std::optional<std::string> resolve_file(const std::string& name, const SourceLocation&) override {
    return std::filesystem::exists(name) ? std::optional(name) : std::nullopt;
  }

 private:
  std::map<std::string, TexturePtr> textures_;
  Diagnostics& diagnostics_;
};

/// Throws Error with all messages if the dictionary is invalid.
inline BsdfPtr make_bsdf(const Json& dictionary, std::map<std::string, TexturePtr> textures = {}) {
  Diagnostics diagnostics;
  TestFactory factory(std::move(textures), diagnostics);
  auto bsdf = std::dynamic_pointer_cast<const Bsdf>(factory.make(describe(dictionary)));
  diagnostics.throw_if_errors();
  return bsdf;
}

/// The messages of the errors that make_bsdf() throws; "" if there are none.
inline std::string bsdf_errors(const Json& dictionary, std::map<std::string, TexturePtr> textures = {}) {
  try {
    make_bsdf(dictionary, std::move(textures));
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

/// A hit whose shading frame and unit tangents are the coordinate axes.
inline SurfaceHit flat_hit() {
  SurfaceHit hit;
  hit.ng = {0, 0, 1};
  hit.uv = {0.5f, 0.5f};
  hit.dp_du = {1, 0, 0};
  hit.dp_dv = {0, 1, 0};
  return hit;
}

/// A texture with given values and derivatives, not marked constant.
class TestTexture final : public Texture {
 public:
  explicit TestTexture(const Spectrum& value, Vec2 gradient = {}) : value_(value), gradient_(gradient) {}
  Spectrum eval(const SurfaceHit&) const override { return value_; }
  float eval_1(const SurfaceHit&) const override { return luminance(value_); }
  Vec2 grad_1(const SurfaceHit&) const override { return gradient_; }
  float mean() const override { return covary::mean(value_); }

 private:
  Spectrum value_;
  Vec2 gradient_;
};

}  // namespace covary::testing
