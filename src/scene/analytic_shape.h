// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/sphere.h"
#include "core/transform.h"
#include "scene/shape.h"

namespace covary {

/// A shape given by a formula instead of triangles; the ray tracer calls intersect().
class AnalyticShape : public Shape {
 public:
  /// Distance of the nearest intersection in (0, ray.t_max), or infinity.
  virtual float intersect(const Ray& ray) const = 0;
};

/// The unit sphere under `to_world` * translate(center) * scale(radius); normals point outwards unless flipped. The
/// transformation must be a similarity: otherwise Error(kInput). (u, v) = (phi / 2 pi, theta / pi) around the local z.
class Sphere final : public AnalyticShape {
 public:
  Sphere(const Transform& to_world, const Vec3& center, float radius, bool flip_normals);
  float intersect(const Ray& ray) const override;
  Bounds3 bounds() const override;
  void fill(const Ray& ray, SurfaceHit& hit, bool with_derivatives) const override;
  float area() const override { return 4 * kPi * radius_ * radius_; }
  AreaSample sample_area(Vec2 u, float u_primitive) const override;
  std::shared_ptr<Shape> transformed(const Transform& to_world) const override;
  /// From outside: uniform in the cone the sphere subtends.
  EmitterSample sample_towards(const Vec3& reference, Vec2 u, float u_primitive) const override;
  float pdf_solid_angle(const Vec3& reference, const SurfaceHit& hit) const override;
  Ball ball() const { return {center_, radius_, sign_}; }

 private:
  /// World direction to the sphere's own axes; preserves length.
  Vec3 to_local(const Vec3& d) const { return {dot(axes_[0], d), dot(axes_[1], d), dot(axes_[2], d)}; }

  Transform to_world_;
  Vec3 axes_[3];  // unit images of the local axes
  Vec3 center_;
  float radius_;
  float sign_;
};

/// The unit disk z = 0 under `to_world`, normal +z unless flipped. (u, v) = (r, phi / 2 pi).
class Disk final : public AnalyticShape {
 public:
  Disk(const Transform& to_world, bool flip_normals);
  float intersect(const Ray& ray) const override;
  Bounds3 bounds() const override;
  void fill(const Ray& ray, SurfaceHit& hit, bool with_derivatives) const override;
  float area() const override { return area_; }
  AreaSample sample_area(Vec2 u, float u_primitive) const override;
  std::shared_ptr<Shape> transformed(const Transform& to_world) const override;

 private:
  Transform to_world_, to_local_;
  Vec3 normal_;
  float area_;
  bool flipped_;
};

/// Lateral surface of a cylinder from p0 to p1, open at both ends, under `to_world`; normals point outwards unless
/// flipped. (u, v) = (phi / 2 pi, position along the axis in [0, 1]). Non-uniform scale is an Error(kInput).
class Cylinder final : public AnalyticShape {
 public:
  /// The unit cylinder x^2 + y^2 = 1, z in [0, 1], under `to_world`.
  Cylinder(const Transform& to_world, bool flip_normals);
  Cylinder(const Transform& to_world, const Vec3& p0, const Vec3& p1, float radius, bool flip_normals);
  float intersect(const Ray& ray) const override;
  Bounds3 bounds() const override;
  void fill(const Ray& ray, SurfaceHit& hit, bool with_derivatives) const override;
  float area() const override { return area_; }
  AreaSample sample_area(Vec2 u, float u_primitive) const override;
  std::shared_ptr<Shape> transformed(const Transform& to_world) const override;

 private:
  Transform to_world_, to_local_;  // of the unit cylinder x^2 + y^2 = 1, z in [0, 1]
  float area_;
  float slack_;  // of its points (core/rounding.h)
  float sign_;
};

}  // namespace covary
