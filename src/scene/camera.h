// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "core/ray.h"
#include "core/transform.h"
#include "scene/object.h"

namespace covary {

/// Which extent of the film the field of view refers to (Mitsuba's names).
enum class FovAxis { kX, kY, kDiagonal, kSmaller, kLarger };

/// Half the extent along x at distance 1 of an image with this field of view; `aspect`: width over height.
float half_extent_x(float fov_degrees, FovAxis axis, float aspect);

/// Maps from the film to all directions. In the camera's space, x to the left, y up, the film's centre looks along z:
///   kLatitudeLongitude   (sin t sin p, cos t, -sin t cos p) with t = pi y and p = 2 pi x, (x, y) in [0, 1]^2 from the
///                        film's upper left corner, as Mitsuba 0.x's sensor `spherical` and pbrt's
///   kEqualArea           (b, c, -a) of (a, b, c) = equal_area_direction(x, y), as pbrt-v4's
enum class Panorama { kNone, kLatitudeLongitude, kEqualArea };

/// Perspective camera with a pinhole or a thin lens, orthographic camera, or one that looks in all directions.
struct CameraSettings {
  Transform to_world;
  bool orthographic = false;  ///< parallel rays along z from [-1, 1]^2, its height scaled by the film's aspect
  Panorama panorama = Panorama::kNone;  ///< else, a pinhole that sees all directions; clip distances are those to it
  float fov_degrees = 50;               ///< full angle, in (0, 180)
  FovAxis fov_axis = FovAxis::kX;
  float near_clip = 1e-2f, far_clip = 1e4f;  ///< distances along the viewing axis
  Vec2 principal_point_offset{0, 0};         ///< relative to the film's size
  float aperture_radius = 0;                 ///< 0: pinhole
  float focus_distance = 1;                  ///< distance along the viewing axis in focus (thin lens)
};

/// A point on the lens as seen from a reference point in the scene. In the terms of EmitterSample, the camera is a
/// light that emits importance: a light path arriving at the reference point adds throughput * importance /
/// pdf_solid_angle to the film if the lens is visible.
struct LensSample {
  Vec3 wi;             ///< unit direction from the reference point to the lens
  float distance = 0;  ///< to the lens
  Vec3 p;              ///< point on the lens; the camera's position for a pinhole
  Vec3 near_p;         ///< on the near plane between them: what is in front of it does not occlude the reference point
  Vec2 film;           ///< film position of the ray, in pixels of the full frame, possibly outside it
  /// Camera::importance() towards the reference point; for a pinhole, already multiplied by the cosine at the lens and
  /// divided by the squared distance.
  float importance = 0;
  float pdf_solid_angle = 0;  ///< density of wi at the reference point; 1 for a pinhole; 0: not between the clip planes
  float pdf_direction = 0;    ///< Camera::pdf_direction() towards the reference point
};

class Camera : public SceneObject {
 public:
  /// `width`, `height`: the full frame in pixels.
  Camera(const CameraSettings& settings, int width, int height);
  /// Ray through the film position `film` in pixels of the full frame (x right, y down; pixel centres at +0.5); `lens`
  /// uniform in [0,1)^2. The origin lies on the near plane, t_max on the far plane.
  Ray ray(Vec2 film, Vec2 lens) const;

  // The following describes rays through any point of the film plane, including outside the frame, with density 1 per
  // pixel of film area: the measurement is that of one pixel. Directions `d` are unit vectors leaving the camera.
  /// Pinhole: the position of the lens is a delta.
  bool is_delta() const { return !(settings_.aperture_radius > 0); }
  /// All rays are parallel. The functions of directions, project() and sample_towards() are then unavailable: no light
  /// path finds the camera.
  bool is_orthographic() const { return settings_.orthographic; }
  bool is_panorama() const { return settings_.panorama != Panorama::kNone; }
  /// Density of the lens position, per unit area of the lens; 1 for a pinhole.
  float pdf_position() const { return pdf_position_; }
  /// Density of the ray's direction per unit solid angle; the same for all points on the lens. 0 behind the camera.
  float pdf_direction(const Vec3& d) const;
  /// Importance We of the direction [Veach1997] §3.7: its integral over the directions through a film area, times the
  /// cosine at the lens, and over the lens (or at the pinhole), is that area in pixels.
  float importance(const Vec3& d) const;
  /// Film position, in pixels of the full frame, of a ray through the point `p` in direction `d`; inverse of ray(). A
  /// pinhole uses only `d`. `d` must point forwards (pdf_direction() > 0).
  Vec2 project(const Vec3& p, const Vec3& d) const;
  /// Samples the lens uniformly as seen from `reference`; `u` uniform in [0,1)^2.
  LensSample sample_towards(const Vec3& reference, Vec2 u) const;

  const CameraSettings& settings() const { return settings_; }
  int width() const { return width_; }
  int height() const { return height_; }

 private:
  CameraSettings settings_;
  int width_, height_;
  float tan_x_, tan_y_;  // half extents of the image plane at distance 1
  Vec3 origin_, x_, y_, z_;
  Vec3 to_x_, to_y_, to_z_;  // rows of the inverse of (x_, y_, z_): local coordinates of world vectors
  Ray orthographic_ray(float sx, float sy) const;
  Ray panorama_ray(float sx, float sy) const;
  Vec2 project_panorama(const Vec3& d) const;
  Vec3 lens_normal_;  // unit, along the viewing axis
  float pdf_position_ = 1;
  float pixels_per_area_;  // film area in pixels over area of the image plane at distance 1, in world units
};

}  // namespace covary
