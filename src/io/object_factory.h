// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <unordered_map>
#include <unordered_set>

#include "formats/file_resolver.h"
#include "formats/object_builder.h"
#include "scene/parameters.h"

namespace covary {

/// Objects created so far, by description; shared by the factories of a scene.
class MadeObjects {
 public:
  using Object = std::shared_ptr<const SceneObject>;
  /// False if `description` was never created; `object` may be null if creation failed.
  bool find(const ObjectDescription* description, Object& object) const;
  void add(const ObjectDescription* description, Object object);

 private:
  mutable std::mutex mutex_;
  std::unordered_map<const ObjectDescription*, Object> objects_;
};

/// Creates textures, reflectance models, emitters and the parts of sensors through the registries of their modules.
/// Each factory reports to one Diagnostics; several may work concurrently on descriptions that share no nested object.
class SceneFactory final : public ObjectFactory {
 public:
  SceneFactory(MadeObjects& made, FileResolver& files, Diagnostics& diagnostics)
      : made_(made), files_(files), diagnostics_(diagnostics) {}

  std::shared_ptr<const SceneObject> make(const ObjectPtr& description) override;
  std::optional<std::string> resolve_file(const std::string& name, const SourceLocation& where) override;

 private:
  std::shared_ptr<const SceneObject> create(const ObjectDescription& description);
  /// What takes the place of an object of unknown type where those are ignored, otherwise null.
  std::shared_ptr<const SceneObject> create_instead(const ObjectDescription& unknown);

  MadeObjects& made_;
  FileResolver& files_;
  Diagnostics& diagnostics_;
};

/// Records that there is no such type of that kind, with the nearest names and all `supported` ones.
void report_unknown_type(const ObjectDescription& description, std::vector<std::string> supported,
                         Diagnostics& diagnostics);

/// The plugin `type` of a registry; null after recording an error that lists what is supported. `kind` and `extra`
/// (further supported names) are for the message.
template <typename T>
const Plugin<T>* find_plugin(std::span<const Plugin<T>> plugins, const ObjectDescription& description,
                             Diagnostics& diagnostics, std::vector<std::string> extra = {}) {
  for (const Plugin<T>& plugin : plugins)
    if (description.type == plugin.name) return &plugin;
  for (const Plugin<T>& plugin : plugins) extra.emplace_back(plugin.name);
  report_unknown_type(description, std::move(extra), diagnostics);
  return nullptr;
}

/// Returns make(parameters). Records what it throws, except internal errors and kUsage errors of the caller; if it does
/// not throw, reports unused parameters (otherwise it may not have reached them).
template <typename Make>
auto make_checked(Parameters& parameters, Make&& make) -> decltype(make(parameters)) {
  try {
    auto object = make(parameters);
    parameters.report_unknown();
    return object;
  } catch (const Error& error) {
    if (error.code() == ErrorCode::kInternal || error.code() == ErrorCode::kUsage) throw;
    parameters.error(error.what());
    return nullptr;
  }
}

/// A text that is equal for two descriptions without nested objects if and only if they describe the same object: same
/// kind, type and parameters in any order. Ids and locations in the file are ignored.
std::string description_key(const ObjectDescription& object);

/// Objects that other objects hold or reference. Those defined at top level only to be referenced are not part of the
/// scene itself.
inline std::unordered_set<const ObjectDescription*> held_objects(const ObjectDescription& scene) {
  std::unordered_set<const ObjectDescription*> held;
  visit_properties(scene, [&](const ObjectDescription& object, const Property& property) {
    const ObjectPtr* child = std::get_if<ObjectPtr>(&property.value);
    if (child && *child && &object != &scene) held.insert(child->get());
  });
  return held;
}

}  // namespace covary
