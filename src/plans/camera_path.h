// SPDX-License-Identifier: Apache-2.0
// A moving camera, from a JSON file:
//
//   {"frames_per_second": 24,
//    "keyframes": [{"time": 0, "to_world": [[1, 0, 0, 0], [0, 1, 0, 1], [0, 0, 1, -5], [0, 0, 0, 1]]},
//                  {"time": 2, "to_world": [...]}]}
//
// Each matrix (4 rows, or 16 numbers in row order) replaces the sensor's `to_world`. Frame n is at the time n /
// frames_per_second; without that member, times count frames.
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
  double first_time() const { return to_world_.first_time(); }
  double last_time() const { return to_world_.last_time(); }

 private:
  KeyedTransform to_world_;
  double frames_per_second_;
};

/// Throws Error(kInput), naming the file and the problem: not JSON, unknown or missing members, matrices of the wrong
/// size, or anything that KeyedTransform rejects.
CameraPath parse_camera_path(const std::string& text, const std::string& name);
/// The same for a file; also throws Error(kIo).
CameraPath read_camera_path(const std::string& path);

/// Moves the scene's camera between renders; everything else stays built. The content_hash distinguishes films and
/// images by camera transformation and, if shapes move, by time. Throws Error(kInput) for a transformation that the
/// camera does not support.
void place_camera(LoadedScene& scene, const Transform& to_world);

}  // namespace covary
