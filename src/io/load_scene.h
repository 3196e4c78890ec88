// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "scene/parameters.h"
#include "scene/scene.h"

namespace covary {

struct LoadOptions {
  std::map<std::string, std::string> defines;  ///< -D name=value, overriding <default>
  int width = 0, height = 0;                   ///< override the film size when > 0 (the crop is then dropped)
  /// Makes the integrator from the scene's <integrator> element, so that its mistakes are reported with all others.
  /// When empty, the element is only kept in LoadedScene::integrator_type.
  std::function<std::shared_ptr<SceneObject>(Parameters&)> make_integrator;
  /// Take the place of properties of the <integrator> element, or are added to it.
  std::vector<Property> integrator_properties;
};

struct LoadedScene {
  std::unique_ptr<Scene> scene;
  std::shared_ptr<Camera> camera;     ///< the scene's, which may be moved between renders (plans/camera_path.h)
  KeyedTransformPtr camera_to_world;  ///< of a camera that moves by an <animation>, or null
  int width = 0, height = 0;          ///< full frame
  int crop_x = 0, crop_y = 0, crop_width = 0, crop_height = 0;
  FilterSettings filter;
  int spp = 4;                  ///< of the scene's sampler
  std::string sampler_type;     ///< "" when the file names none
  std::string integrator_type;  ///< "" when the file names none
  std::shared_ptr<SceneObject> integrator;
  /// There are lights that are a point or a direction, and mirrors or smooth glass: light of the former by way of the
  /// latter is only found by paths from the lights.
  bool has_delta_lights_and_surfaces = false;
  std::vector<std::string> warnings;
  std::vector<std::string> files;  ///< paths of all files that the scene's file names and that were read
  double read_seconds = 0;         ///< parsing and reading files; Scene::build_seconds() comes on top
  std::string content_hash;  ///< hex; over the scene's XML, defines, all files it reads; where moved, camera and time
  std::string files_hash;    ///< the same without camera and time
};

/// Reads a scene: Mitsuba's XML, "*.pbrt", "*.gltf" or "*.glb". Throws Error(kInput) with every problem of the file, or
/// Error(kIo).
LoadedScene load_scene(const std::string& path, const LoadOptions& options = {});
/// The same for text in memory. `name` stands for the file in messages; files the scene names are looked up in its
/// folder.
LoadedScene load_scene_text(std::string_view xml, const std::string& name, const LoadOptions& options = {});

}  // namespace covary
