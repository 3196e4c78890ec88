// SPDX-License-Identifier: Apache-2.0
// How a scene is looked at, whatever its format: by which camera, and in which surroundings. What is missing is added
// as object descriptions, which `covary convert-scene` writes like those of the file.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "scene/camera.h"
#include "scene/parameters.h"
#include "scene/scene.h"
#include "settings/settings.h"

namespace covary {

struct SceneView {
  std::string environment = "none";    ///< auto, studio, sky, white, none, or the name of an image
  std::optional<Spectrum> background;  ///< seen where the camera sees no surface; default: the environment
  std::string camera;                  ///< name or number from 1; auto: framed; empty: the first, or framed (glTF)
  bool replaces_environment() const { return environment != "auto" && environment != "none"; }
};
/// Declares `environment`, `background` and `camera`.
void declare(Settings& settings, SceneView& view);

/// The sensor that the view chooses among those of the scene; null: it is to be framed, or there is none. Records an
/// error, which lists the sensors, if none has that name or number.
ObjectPtr chosen_sensor(const ObjectDescription& scene, const SceneView& view, Diagnostics& diagnostics);

/// The first sensor of the scene, or null.
ObjectPtr first_sensor(const ObjectDescription& scene);

/// World space as the viewer of a scene thinks of it; unit vectors, perpendicular to each other.
struct Orientation {
  Vec3 up{0, 1, 0}, front{0, 0, 1};  ///< `front`: from the scene to who looks at it
};
/// glTF's; or the axis that is most nearly upwards in the image of a camera, with Blender's front where z is up.
Orientation orientation_of(const CameraSettings* camera);

/// A perspective camera that has the whole box in its image, from the front and a little from above. `like`: whose film
/// and sampler it gets; null: 1280 x 720 pixels, 64 samples. `aspect`: width over height of the image.
ObjectPtr framed_sensor(const Bounds3& bounds, const Orientation& orientation, const ObjectDescription* like,
                        float aspect, const SourceLocation& where);

/// Of the shapes and instances.
Bounds3 bounds_of(const SceneParts& parts);

/// What the view changes and adds, for the hash of the scene; empty if nothing.
std::string text_of(const SceneView& view, const std::vector<ObjectPtr>& added);

/// The scene with the chosen camera alone and with `added`, without lights from all around that these replace.
std::shared_ptr<const ObjectDescription> with_view(const ObjectDescription& scene, const SceneView& view,
                                                   const std::vector<ObjectPtr>& added, Diagnostics& diagnostics);

struct Surroundings {
  std::vector<ObjectPtr> objects;  ///< an emitter at infinity, a floor
  std::string told;                ///< a warning; empty: the caller asked for it
};
/// What is added around the placed scene so that it can be seen. `weak_lights`: area lights that give less than a
/// twentieth of the light of white surroundings count as none.
Surroundings surroundings(const SceneView& view, const SceneParts& parts, const CameraSettings& camera,
                          const Orientation& orientation, bool weak_lights, const SourceLocation& where);

}  // namespace covary
