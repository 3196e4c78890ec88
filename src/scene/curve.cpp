// SPDX-License-Identifier: Apache-2.0
// Embree finds the hits and gives the parameter along the segment; the rest follows Mitsuba, so that textures are
// placed as they are there. On a tube p = c(v) + r(v) rad the normal is (|c'|^2 - rad r . c'') rad - r' c', normalised.
#include "scene/curve.h"

#include <cmath>
#include <string>
#include <utility>

#include "core/error.h"

namespace covary {
namespace {

/// Two directions orthogonal to the unit tangent, the reference for the angle around the curve.
std::pair<Vec3, Vec3> axes_across(const Vec3& tangent) {
  const Vec3 guide{0, 0, 1}, across = guide - tangent * dot(tangent, guide);
  const float l = length(across);
  const Vec3 rotated = l > 1e-6f ? across * (1 / l) : Vec3{0, 1, 0};
  return {rotated, cross(rotated, tangent)};
}

}  // namespace

CurveShape::CurveShape(CurveKind kind, std::vector<CurvePoint> points, std::vector<uint32_t> segments)
    : kind_(kind), points_(std::move(points)), segments_(std::move(segments)) {
  if (segments_.empty()) throw Error(ErrorCode::kInput, "there is no curve");
  for (size_t i = 0; i < points_.size(); ++i) {
    const auto& [x, y, z, r] = points_[i];
    if (!is_finite(Vec3{x, y, z}) || !(r >= 0) || !std::isfinite(r))
      throw Error(ErrorCode::kInput, "control point " + std::to_string(i) +
                                         " of a curve is not finite, or its radius is "
                                         "negative");
    bounds_.extend(Vec3{x, y, z} - Vec3{r, r, r});
    bounds_.extend(Vec3{x, y, z} + Vec3{r, r, r});
  }
  const size_t n = kind_ == CurveKind::kLinear ? 2 : 4;
  for (const uint32_t first : segments_)
    if (first + n > points_.size()) throw Error(ErrorCode::kInput, "a curve refers to a missing control point");
}

float CurveShape::shortest_segment() const {
  float shortest = kInfinity;
  for (const uint32_t i : segments_) {
    const CurvePoint &a = points_[i], &b = points_[i + 1];
    const float l = length(Vec3{b[0], b[1], b[2]} - Vec3{a[0], a[1], a[2]});
    if (l > 0) shortest = std::min(shortest, l);
  }
  return shortest;
}

CurveShape::Centre CurveShape::centre(uint32_t segment, float v) const {
  const CurvePoint* q = &points_[segments_[segment]];
  const Vec3 origin{q[0][0], q[0][1], q[0][2]};
  const auto at = [&](int i) { return Vec3{q[i][0], q[i][1], q[i][2]} - origin; };
  if (kind_ == CurveKind::kLinear) {
    const Vec3 along = at(1);
    return {origin, along * v, along, {}, lerp(v, q[0][3], q[1][3]), q[1][3] - q[0][3], max_component(abs(along))};
  }
  // Uniform cubic B-spline: weights of the four points, and their first and second derivatives.
  const float w = 1 - v, sixth = 1.0f / 6;
  const float b[4] = {sixth * w * w * w, sixth * (3 * v * v * v - 6 * v * v + 4),
                      sixth * (-3 * v * v * v + 3 * v * v + 3 * v + 1), sixth * v * v * v};
  const float d[4] = {-0.5f * w * w, 0.5f * (3 * v * v - 4 * v), 0.5f * (-3 * v * v + 2 * v + 1), 0.5f * v * v};
  const float dd[4] = {w, 3 * v - 2, 1 - 3 * v, v};
  Centre result{};
  result.origin = origin;
  for (int i = 0; i < 4; ++i) {
    result.c += at(i) * b[i];
    result.dc += at(i) * d[i];
    result.ddc += at(i) * dd[i];
    result.r += q[i][3] * b[i];
    result.dr += q[i][3] * d[i];
    result.reach = std::max(result.reach, max_component(abs(at(i))));
  }
  return result;
}

void CurveShape::fill(const Ray& ray, SurfaceHit& hit, bool with_derivatives) const {
  const float v = hit.barycentric.x;
  const Centre m = centre(hit.primitive, v);
  // The point at the distance found by Embree, moved onto the tube.
  const Vec3 found = (ray.o - m.origin) + ray.d * hit.t - m.c;
  const float away = length(found), radius = m.r, speed2 = length_squared(m.dc);
  const Vec3 rad = away > 0 ? found * (radius / away) : Vec3{};
  hit.p = m.origin + (m.c + rad);
  Vec3 n = rad;
  if (kind_ == CurveKind::kBspline) n = rad * (speed2 - dot(rad, m.ddc)) - m.dc * (m.dr * radius);
  const float l = length(n);
  hit.ng = l > 0 ? n * (1 / l) : -normalize(ray.d);
  hit.offset = surface_offset(hit.p, hit.ng, 8 * (m.reach + radius));
  const Vec3 tangent = speed2 > 0 ? m.dc * (1 / std::sqrt(speed2)) : Vec3{0, 0, 1};
  const auto [rotated, radial] = axes_across(tangent);
  float angle = std::atan2(dot(rotated, rad), dot(radial, rad)) * kInvPi * 0.5f;
  if (angle < 0) angle += 1;
  const float n_segments = static_cast<float>(segments_.size());
  hit.uv = {angle, (v + static_cast<float>(hit.primitive)) / n_segments};
  if (!with_derivatives) {
    hit.frame = Frame(hit.ng);
    return;
  }
  hit.dp_du = cross(tangent, rad) * kTwoPi;
  // Along the curve at a fixed angle; the twist of the reference axes is neglected.
  const float stretch = speed2 > 0 ? 1 - dot(rad, m.ddc) / speed2 : 1;
  hit.dp_dv = (m.dc * stretch + (radius > 0 ? rad * (m.dr / radius) : Vec3{})) * n_segments;
  hit.frame = Frame::from_tangent(hit.ng, hit.dp_du);
}

std::shared_ptr<Shape> CurveShape::transformed(const Transform& to_world) const {
  std::vector<CurvePoint> points = points_;
  for (CurvePoint& q : points) {
    const Vec3 p = to_world.point({q[0], q[1], q[2]});
    q = {p.x, p.y, p.z, q[3]};
  }
  return std::make_shared<CurveShape>(kind_, std::move(points), segments_);
}

}  // namespace covary
