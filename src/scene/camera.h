// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "core/ray.h"
#include "core/transform.h"
#include "scene/object.h"

namespace covary {

/// Which extent of the film the field of view spans (Mitsuba's names).
enum class FovAxis { kX, kY, kDiagonal, kSmaller, kLarger };

/// Perspective camera with a pinhole or a thin lens.
struct CameraSettings {
  Transform to_world;
  float fov_degrees = 50;  ///< full angle, in (0, 180)
  FovAxis fov_axis = FovAxis::kX;
  float near_clip = 1e-2f, far_clip = 1e4f;  ///< distances along the viewing axis
  Vec2 principal_point_offset{0, 0};         ///< relative to the film's size
  float aperture_radius = 0;                 ///< 0: pinhole
  float focus_distance = 1;                  ///< distance along the viewing axis in focus (thin lens)
};

class Camera : public SceneObject {
 public:
  /// `width`, `height`: the full frame in pixels.
  Camera(const CameraSettings& settings, int width, int height);
  /// Ray through the film position `film` in pixels of the full frame (x right, y down; pixel centres at +0.5); `lens`
  /// uniform in [0,1)^2. The origin lies on the near plane, t_max on the far plane.
  Ray ray(Vec2 film, Vec2 lens) const;
  const CameraSettings& settings() const { return settings_; }
  int width() const { return width_; }
  int height() const { return height_; }

 private:
  CameraSettings settings_;
  int width_, height_;
  float tan_x_, tan_y_;  // half extents of the image plane at distance 1
  Vec3 origin_, x_, y_, z_;
};

}  // namespace covary
