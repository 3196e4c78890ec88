// SPDX-License-Identifier: Apache-2.0
// Creates plugins in tests without a scene file, from a list of parameters, and records all errors.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/error.h"
#include "scene/parameters.h"

namespace covary::test_support {

/// Returns objects made beforehand, by description, and finds files by path.
class GivenObjects final : public ObjectFactory {
 public:
  explicit GivenObjects(Diagnostics& diagnostics) : diagnostics_(diagnostics) {}

  std::shared_ptr<const SceneObject> make(const ObjectPtr& description) override {
    for (const auto& [known, object] : objects_)
      if (known == description) return object;
    return nullptr;
  }
  std::optional<std::string> resolve_file(const std::string& name, const SourceLocation& where) override {
    if (std::filesystem::exists(name)) return name;
    diagnostics_.error(where, "file '" + name + "' does not exist");
    return std::nullopt;
  }
  /// A parameter value for `object`, as if nested in the scene file with the tag `kind`.
  Value nest(const std::string& kind, std::shared_ptr<const SceneObject> object) {
    auto description = std::make_shared<ObjectDescription>();
    description->kind = kind, description->type = "given";
    objects_.emplace_back(description, std::move(object));
    return ObjectPtr(objects_.back().first);
  }

 private:
  Diagnostics& diagnostics_;
  std::vector<std::pair<ObjectPtr, std::shared_ptr<const SceneObject>>> objects_;
};

/// Result of creating a plugin: the object, or all errors, one per line.
template <typename T>
struct Made {
  std::shared_ptr<T> object;
  std::string errors;
};

using NamedValues = std::vector<std::pair<std::string, Value>>;

/// Makes the plugin `type` of `plugins` from `values`. Errors place parameter i in line i + 2 of "test.xml".
template <typename T, typename Plugins>
Made<T> make_plugin(const Plugins& plugins, const std::string& kind, const std::string& type, const NamedValues& values,
                    GivenObjects& objects, Diagnostics& diagnostics) {
  ObjectDescription description;
  description.kind = kind, description.type = type, description.where = {"test.xml", 1, 1};
  for (size_t i = 0; i < values.size(); ++i)
    description.properties.push_back({values[i].first, values[i].second, {"test.xml", static_cast<int>(i) + 2, 1}});
  Made<T> made;
  for (const auto& plugin : plugins) {
    if (plugin.name != type) continue;
    Parameters parameters(description, objects, diagnostics);
    made.object = plugin.make(parameters);
    parameters.report_unknown();
  }
  try {
    diagnostics.throw_if_errors();
  } catch (const Error& error) {
    made.errors = error.what();
  }
  return made;
}

/// The same without nested objects.
template <typename T, typename Plugins>
Made<T> make_plugin(const Plugins& plugins, const std::string& kind, const std::string& type,
                    const NamedValues& values) {
  Diagnostics diagnostics;
  GivenObjects objects(diagnostics);
  return make_plugin<T>(plugins, kind, type, values, objects, diagnostics);
}

}  // namespace covary::test_support
