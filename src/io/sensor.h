// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "scene/camera.h"
#include "scene/parameters.h"
#include "scene/scene.h"

namespace covary {

/// <film>: size, crop window and reconstruction filter.
struct FilmSettings : SceneObject {
  int width = 768, height = 576;
  int crop_x = 0, crop_y = 0, crop_width = 768, crop_height = 576;
  FilterSettings filter{FilterKind::kGaussian, 2.0f, 0.5f};
  std::optional<ColourMatrix> response;
};

struct FilterObject : SceneObject {
  FilterSettings settings;
};

struct SamplerSettings : SceneObject {
  std::string type;  ///< its name in the scene; empty if there is none
  int sample_count = 4;
};

/// <sensor>: the camera without its film size, which the command line may change.
struct SensorSettings : SceneObject {
  CameraSettings camera;       ///< pose when the shutter opens
  KeyedTransformPtr to_world;  ///< of an animated camera; otherwise null
  double shutter_open = 0, shutter_close = 0;
  MediumPtr medium;  ///< medium around the camera; null: none
  FilmSettings film;
  SamplerSettings sampler;
};

/// That motion is not blurred, for a sensor whose shutter is open for a while.
std::string told_of_blur(const SensorSettings& sensor);
/// Width over height of a sensor's film, of which either may be overridden by a number > 0; null: 16:9.
float aspect_of(const SensorSettings* sensor, int width, int height);

// Each records an error for anything it does not support.
std::shared_ptr<FilterObject> make_filter(Parameters& parameters);
std::shared_ptr<FilmSettings> make_film(Parameters& parameters);
std::shared_ptr<SamplerSettings> make_sampler(Parameters& parameters);
std::shared_ptr<SensorSettings> make_sensor(Parameters& parameters);

/// Told of films with alpha.
inline constexpr const char* kAlphaOnDemand = "alpha is written if `--alpha` asks for it";

}  // namespace covary
