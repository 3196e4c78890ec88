// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <vector>

#include "scene/shape.h"

namespace covary {

enum class CurveKind { kLinear, kBspline };

/// Embree 3.13 misses linear curves, or sees them too thick, if their segments are shorter than about 0.005: those that
/// are shorter than this are traced enlarged.
inline constexpr float kShortSegment = 0.0625f;

/// A control point: x, y, z and the radius there, laid out as the ray tracer reads it.
using CurvePoint = std::array<float, 4>;

/// Round tubes around piecewise linear curves or cubic B-splines, the latter with open ends; visible from outside only.
/// (u, v) = (angle around the curve / 2 pi, position along all segments in [0, 1]). They cannot emit light.
class CurveShape final : public Shape {
 public:
  /// `segments`: the first control point of each; a segment has 2 control points (linear) or 4 (B-spline). Throws
  /// Error(kInput) if an index is out of range or a number is not finite.
  CurveShape(CurveKind kind, std::vector<CurvePoint> points, std::vector<uint32_t> segments);

  Bounds3 bounds() const override { return bounds_; }
  void fill(const Ray& ray, SurfaceHit& hit, bool with_derivatives) const override;
  float area() const override { return 0; }
  size_t n_primitives() const override { return segments_.size(); }
  AreaSample sample_area(Vec2, float) const override { return {}; }
  bool can_emit() const override { return false; }
  std::shared_ptr<Shape> transformed(const Transform& to_world) const override;

  CurveKind kind() const { return kind_; }
  /// Length of the shortest segment of positive length between its first two control points; infinity: there is none.
  float shortest_segment() const;
  const std::vector<CurvePoint>& points() const { return points_; }
  const std::vector<uint32_t>& segments() const { return segments_; }

 private:
  /// Centre line and radius at parameter v of a segment, with derivatives by v.
  struct Centre {
    Vec3 origin, c, dc, ddc;  // c relative to the first control point
    float r, dr;
    float reach;  // largest coordinate of control points relative to the first
  };
  Centre centre(uint32_t segment, float v) const;

  CurveKind kind_;
  std::vector<CurvePoint> points_;
  std::vector<uint32_t> segments_;
  Bounds3 bounds_;
};

}  // namespace covary
