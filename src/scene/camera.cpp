// SPDX-License-Identifier: Apache-2.0
#include "scene/camera.h"

#include <algorithm>

#include "core/equal_area.h"
#include "core/error.h"
#include "core/warp.h"

namespace covary {

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
  if (settings.orthographic) {
    tan_x_ = 1, tan_y_ = 1 / aspect;
    return;
  }
  const float tolerance = 1e-3f;
  if (std::abs(length(x_) - 1) > tolerance || std::abs(length(y_) - 1) > tolerance ||
      std::abs(length(z_) - 1) > tolerance)
    throw Error(ErrorCode::kInput, "the to_world transformation of a sensor must not scale");

  // The axes need not be exactly orthonormal.
  const Vec3 z_area = cross(x_, y_);
  const float volume = dot(z_area, z_);
  to_x_ = cross(y_, z_) * (1 / volume);
  to_y_ = cross(z_, x_) * (1 / volume);
  to_z_ = z_area * (1 / volume);
  lens_normal_ = normalize(to_z_);
  if (!is_delta()) pdf_position_ = 1 / (kPi * sqr(settings.aperture_radius) * length(z_area));
  pixels_per_area_ = static_cast<float>(width) * static_cast<float>(height) / (4 * tan_x_ * tan_y_ * std::abs(volume));
}

Ray Camera::ray(Vec2 film, Vec2 lens) const {
  // The camera's x axis points left in the image, its y axis up.
  const float sx = film.x / static_cast<float>(width_) + settings_.principal_point_offset.x;
  const float sy = film.y / static_cast<float>(height_) + settings_.principal_point_offset.y;
  if (settings_.orthographic) return orthographic_ray(sx, sy);
  if (is_panorama()) return panorama_ray(sx, sy);
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

Ray Camera::orthographic_ray(float sx, float sy) const {
  const Vec3 on_film = x_ * ((1 - 2 * sx) * tan_x_) + y_ * ((1 - 2 * sy) * tan_y_);
  return {origin_ + on_film + z_ * settings_.near_clip, normalize(z_), settings_.far_clip - settings_.near_clip};
}

Ray Camera::panorama_ray(float sx, float sy) const {
  Vec3 d;
  if (settings_.panorama == Panorama::kEqualArea) {
    // Samples of a pixel filter may lie beyond the square's edges, where the map goes on mirrored.
    Vec2 at{sx, sy};
    if (at.x < 0 || at.x > 1) at = {at.x < 0 ? -at.x : 2 - at.x, 1 - at.y};
    if (at.y < 0 || at.y > 1) at = {1 - at.x, at.y < 0 ? -at.y : 2 - at.y};
    const Vec3 on_sphere = equal_area_direction({clamp01(at.x), clamp01(at.y)});
    d = {on_sphere.y, on_sphere.z, -on_sphere.x};
  } else {
    const float theta = kPi * sy, phi = kTwoPi * sx, sine = std::sin(theta);
    d = {sine * std::sin(phi), std::cos(theta), -sine * std::cos(phi)};
  }
  const Vec3 world = normalize(x_ * d.x + y_ * d.y + z_ * d.z);
  return {origin_ + world * settings_.near_clip, world, settings_.far_clip - settings_.near_clip};
}

Vec2 Camera::project_panorama(const Vec3& d) const {
  const Vec3 local = normalize(Vec3{dot(to_x_, d), dot(to_y_, d), dot(to_z_, d)});
  Vec2 at;
  if (settings_.panorama == Panorama::kEqualArea) {
    at = equal_area_square({-local.z, local.x, local.y});
  } else {
    const float phi = std::atan2(local.x, -local.z);
    at = {(phi < 0 ? phi + kTwoPi : phi) / kTwoPi, std::acos(std::clamp(local.y, -1.0f, 1.0f)) * kInvPi};
  }
  return {at.x * static_cast<float>(width_), at.y * static_cast<float>(height_)};
}

float Camera::pdf_direction(const Vec3& d) const {
  if (is_panorama()) {
    const float pixels = static_cast<float>(width_) * static_cast<float>(height_);
    if (settings_.panorama == Panorama::kEqualArea) return pixels / (4 * kPi);
    const float sine = std::max(std::sqrt(std::max(1 - sqr(dot(to_y_, d)), 0.0f)), 1e-4f);
    return pixels / (2 * sqr(kPi) * sine);
  }
  // The ray meets the image plane at d / z, where an area covers the solid angle area * z^3 (for skewed axes, times
  // their volume).
  const float z = dot(to_z_, d);
  return z > 0 ? pixels_per_area_ / (z * z * z) : 0;
}

float Camera::importance(const Vec3& d) const {
  const float pdf = pdf_direction(d);
  if (is_panorama()) return pdf;  // the pinhole faces each direction
  return pdf > 0 ? pdf * pdf_position_ / dot(lens_normal_, d) : 0;
}

Vec2 Camera::project(const Vec3& p, const Vec3& d) const {
  if (is_panorama()) return project_panorama(d);
  const float inverse_z = 1 / dot(to_z_, d);
  float x = dot(to_x_, d) * inverse_z, y = dot(to_y_, d) * inverse_z;
  if (!is_delta()) {
    // Where the ray meets the focal plane, seen from the centre of the lens.
    const Vec3 o = p - origin_;
    const float z = dot(to_z_, o), inverse_focus = 1 / settings_.focus_distance;
    x += (dot(to_x_, o) - z * x) * inverse_focus;
    y += (dot(to_y_, o) - z * y) * inverse_focus;
  }
  const Vec2 offset = settings_.principal_point_offset;
  return {(0.5f * (1 - x / tan_x_) - offset.x) * static_cast<float>(width_),
          (0.5f * (1 - y / tan_y_) - offset.y) * static_cast<float>(height_)};
}

LensSample Camera::sample_towards(const Vec3& reference, Vec2 u) const {
  LensSample sample;
  const float z = is_panorama() ? length(reference - origin_) : dot(to_z_, reference - origin_);
  if (!(z > settings_.near_clip && z < settings_.far_clip)) return sample;
  sample.p = origin_;
  if (!is_delta()) {
    const Vec2 on_lens = warp::square_to_disk(u) * settings_.aperture_radius;
    sample.p += x_ * on_lens.x + y_ * on_lens.y;
  }
  const Vec3 d = reference - sample.p;
  const float distance_squared = length_squared(d);
  sample.distance = std::sqrt(distance_squared);
  const Vec3 out = d * (1 / sample.distance);
  sample.wi = -out;
  sample.near_p = sample.p + d * (settings_.near_clip / z);
  sample.film = project(sample.p, out);
  sample.pdf_direction = pdf_direction(out);
  if (is_delta()) {
    sample.importance = sample.pdf_direction / distance_squared;
    sample.pdf_solid_angle = 1;
  } else {
    sample.importance = importance(out);
    sample.pdf_solid_angle = pdf_position_ * distance_squared / dot(lens_normal_, out);
  }
  return sample;
}

}  // namespace covary
