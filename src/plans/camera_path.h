// SPDX-License-Identifier: Apache-2.0
// A camera that moves, from a JSON file:
//
//   {"frames_per_second": 24,
//    "keyframes": [{"time": 0, "to_world": [[1, 0, 0, 0], [0, 1, 0, 1], [0, 0, 1, -5], [0, 0, 0, 1]]},
//                  {"time": 2, "to_world": [...]}]}
//
// Each matrix (4 rows, or 16 numbers by rows) takes the place of the sensor's `to_world` in the scene. Frame n is at
// the time n / frames_per_second; without that member times are numbers of frames.
#pragma once

#include <string>

#include "core/keyed_transform.h"
#include "io/load_scene.h"

namespace covary {

class CameraPath {
 public:
  CameraPath(KeyedTransform to_world, double frames_per_second)
      : to_world_(std::move(to_world)), frames_per_second_(frames_per_second) {}
  Transform at(double time) const { return to_world_.at(time); }
  double frames_per_second() const { return frames_per_second_; }

 private:
  KeyedTransform to_world_;
  double frames_per_second_;
};

/// Throws Error(kInput) that names the file and what is wrong: no JSON, unknown or missing members, matrices of other
/// sizes, and all that KeyedTransform does not take.
CameraPath parse_camera_path(const std::string& text, const std::string& name);
/// The same of a file; also throws Error(kIo).
CameraPath read_camera_path(const std::string& path);

/// Puts the scene's camera elsewhere, between renders; all else stays as it was built. Films and images of the scene
/// are then told from those of other places, and where shapes move, of other times, by its content_hash. Throws
/// Error(kInput) for a transformation that the camera cannot have.
void place_camera(LoadedScene& scene, const Transform& to_world);

}  // namespace covary
