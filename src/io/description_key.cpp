// SPDX-License-Identifier: Apache-2.0
#include "io/description_key.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <vector>

namespace covary {
namespace {

/// Type and value, numbers to the last bit.
struct ValueText {
  std::string operator()(bool v) const { return v ? "b1" : "b0"; }
  std::string operator()(int64_t v) const { return fmt::format("i{}", v); }
  std::string operator()(double v) const { return fmt::format("f{:a}", v); }
  std::string operator()(const std::string& v) const { return fmt::format("s{}:{}", v.size(), v); }
  std::string operator()(const Vec3& v) const { return fmt::format("v{:a},{:a},{:a}", v.x, v.y, v.z); }
  std::string operator()(const ColourValue& v) const {
    return fmt::format("c{:a},{:a},{:a}", v.rgb.r, v.rgb.g, v.rgb.b);
  }
  std::string operator()(const SampledSpectrum& v) const {
    std::string text = "l";
    for (const auto& [wavelength, value] : v.samples) text += fmt::format("{:a}:{:a},", wavelength, value);
    return text;
  }
  static std::string matrix(const Matrix4& m) {
    std::string text = "t";
    for (const auto& row : m)
      for (double entry : row) text += fmt::format("{:a},", entry);
    return text;
  }
  std::string operator()(const Transform& v) const { return matrix(v.matrix()); }
  std::string operator()(const KeyedTransformPtr& v) const {
    std::string text = "a";
    for (const TransformKey& key : v->keys()) text += fmt::format("{:a}{}", key.time, matrix(key.matrix));
    return text;
  }
  std::string operator()(const ObjectPtr& v) const { return fmt::format("o{}", fmt::ptr(v.get())); }
};

}  // namespace

std::string description_key(const ObjectDescription& object) {
  std::vector<std::string> parameters;
  for (const Property& property : object.properties)
    parameters.push_back(property.name + "=" + std::visit(ValueText{}, property.value) + "\n");
  std::sort(parameters.begin(), parameters.end());
  // Names of files mean something relative to the file they stand in.
  std::string key =
      object.kind + "\n" + object.type + "\n" + std::filesystem::path(object.where.file).parent_path().string() + "\n";
  for (const std::string& parameter : parameters) key += parameter;
  return key;
}

}  // namespace covary
