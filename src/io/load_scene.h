// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "io/scene_view.h"
#include "scene/parameters.h"
#include "scene/scene.h"

namespace covary {

struct LoadOptions {
  std::map<std::string, std::string> defines;  ///< -D name=value, overriding <default>
  bool ignore_unknown = false;                 ///< unknown plugins and parameters are warnings, see Diagnostics
  int width = 0, height = 0;                   ///< override the film size when > 0 (the crop is then dropped)
  std::optional<double> time;                  ///< of a glTF file's animations, in seconds; nullopt: at rest
  SceneView view;                              ///< camera and surroundings; default: as in the file
  /// Creates the integrator from the scene's <integrator> element, so that its errors are reported with all others. If
  /// empty, the element is only recorded in LoadedScene::integrator_type.
  std::function<std::shared_ptr<SceneObject>(Parameters&)> make_integrator;
  /// Override properties of the <integrator> element, or are added to it.
  std::vector<Property> integrator_properties;
};

struct LoadedScene {
  std::unique_ptr<Scene> scene;
  std::shared_ptr<Camera> camera;     ///< the scene's camera; may be moved between renders (plans/camera_path.h)
  KeyedTransformPtr camera_to_world;  ///< of a camera with an <animation>; otherwise null
  int width = 0, height = 0;          ///< full frame
  int crop_x = 0, crop_y = 0, crop_width = 0, crop_height = 0;
  FilterSettings filter;
  int spp = 4;                  ///< of the scene's sampler
  std::string sampler_type;     ///< "" if the file specifies none
  std::string integrator_type;  ///< "" if the file specifies none
  std::shared_ptr<SceneObject> integrator;
  /// The scene has point or directional lights, and mirrors or smooth glass: only paths from the lights can find the
  /// caustics of the former in the latter.
  bool has_delta_lights_and_surfaces = false;
  ObjectPtr sensor;              ///< the camera's description
  std::vector<ObjectPtr> added;  ///< what LoadOptions::view added to the file's objects, the sensor perhaps among it
  std::vector<std::string> warnings;
  std::vector<std::string> files;  ///< paths of all files referenced by the scene's file that were read
  double read_seconds = 0;         ///< parsing and reading files; excludes Scene::build_seconds()
  bool is_animated = false;        ///< by the file itself (glTF): it must be loaded again for another time
  std::string content_hash;        ///< hex; of the XML, defines and all files read; if moved, also camera and time
  std::string files_hash;          ///< the same, never with camera and time
};

/// Loads a scene: Mitsuba XML, "*.pbrt", "*.gltf" or "*.glb". Throws Error(kInput) with all problems of the file, or
/// Error(kIo).
LoadedScene load_scene(const std::string& path, const LoadOptions& options = {});
/// The same for text in memory. `name` is used as the file name in messages, and its folder to look up files.
LoadedScene load_scene_text(std::string_view xml, const std::string& name, const LoadOptions& options = {});

}  // namespace covary
