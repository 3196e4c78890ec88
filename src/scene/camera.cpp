// SPDX-License-Identifier: Apache-2.0
#include "scene/camera.h"

#include "core/error.h"
#include "core/warp.h"

namespace covary {
namespace {

/// Half extent along x of the image plane at distance 1.
float half_extent_x(float fov_degrees, FovAxis axis, float aspect) {
  const float t = std::tan(fov_degrees * (kPi / 360));
  switch (axis) {
    case FovAxis::kX:
      return t;
    case FovAxis::kY:
      return t * aspect;
    case FovAxis::kDiagonal:
      return t * aspect / std::sqrt(1 + aspect * aspect);
    case FovAxis::kSmaller:
      return aspect > 1 ? t * aspect : t;
    case FovAxis::kLarger:
      return aspect > 1 ? t : t * aspect;
  }
  throw Error(ErrorCode::kInternal, "unknown field-of-view axis");
}

}  // namespace

Camera::Camera(const CameraSettings& settings, int width, int height)
    : settings_(settings), width_(width), height_(height) {
  COVARY_CHECK(width > 0 && height > 0, "a camera needs a film of positive size");
  const float aspect = static_cast<float>(width) / static_cast<float>(height);
  tan_x_ = half_extent_x(settings.fov_degrees, settings.fov_axis, aspect);
  tan_y_ = tan_x_ / aspect;
  origin_ = settings.to_world.point({0, 0, 0});
  x_ = settings.to_world.vector({1, 0, 0});
  y_ = settings.to_world.vector({0, 1, 0});
  z_ = settings.to_world.vector({0, 0, 1});
  const float tolerance = 1e-3f;
  if (std::abs(length(x_) - 1) > tolerance || std::abs(length(y_) - 1) > tolerance ||
      std::abs(length(z_) - 1) > tolerance)
    throw Error(ErrorCode::kInput, "the to_world transformation of a sensor must not scale");
}

Ray Camera::ray(Vec2 film, Vec2 lens) const {
  // The camera's x axis points left in the image, its y axis up.
  const float sx = film.x / static_cast<float>(width_) + settings_.principal_point_offset.x;
  const float sy = film.y / static_cast<float>(height_) + settings_.principal_point_offset.y;
  Vec3 d{(1 - 2 * sx) * tan_x_, (1 - 2 * sy) * tan_y_, 1};
  Vec3 o{0, 0, 0};
  if (settings_.aperture_radius > 0) {
    const Vec2 p = warp::square_to_disk(lens);
    o = {p.x * settings_.aperture_radius, p.y * settings_.aperture_radius, 0};
    d = d * settings_.focus_distance - o;
  }
  d = normalize(d);
  const float near_t = settings_.near_clip / d.z, far_t = settings_.far_clip / d.z;
  o += d * near_t;
  return {origin_ + x_ * o.x + y_ * o.y + z_ * o.z, x_ * d.x + y_ * d.y + z_ * d.z, far_t - near_t};
}

}  // namespace covary
