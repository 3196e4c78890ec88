// SPDX-License-Identifier: Apache-2.0
#include "scene/embree_geometry.h"

#include <algorithm>
#include <cmath>

#include "core/detached_work.h"
#include "scene/analytic_shape.h"
#include "scene/curve.h"
#include "scene/mesh.h"

namespace covary {
namespace {

Ray to_ray(RTCRayN* ray, unsigned n, unsigned i) {
  return {{RTCRayN_org_x(ray, n, i), RTCRayN_org_y(ray, n, i), RTCRayN_org_z(ray, n, i)},
          {RTCRayN_dir_x(ray, n, i), RTCRayN_dir_y(ray, n, i), RTCRayN_dir_z(ray, n, i)},
          RTCRayN_tfar(ray, n, i)};
}

void analytic_bounds(const RTCBoundsFunctionArguments* args) {
  Bounds3 b = static_cast<const AnalyticShape*>(args->geometryUserPtr)->bounds();
  b.lower += abs(b.lower) * (-4 * kRounding), b.upper += abs(b.upper) * (4 * kRounding);  // they are rounded
  *args->bounds_o = {b.lower.x, b.lower.y, b.lower.z, 0, b.upper.x, b.upper.y, b.upper.z, 0};
}

void analytic_intersect(const RTCIntersectFunctionNArguments* args) {
  const auto* shape = static_cast<const AnalyticShape*>(args->geometryUserPtr);
  RTCRayN* rays = RTCRayHitN_RayN(args->rayhit, args->N);
  RTCHitN* hits = RTCRayHitN_HitN(args->rayhit, args->N);
  for (unsigned i = 0; i < args->N; ++i) {
    if (!args->valid[i]) continue;
    const float t = shape->intersect(to_ray(rays, args->N, i));
    if (t == kInfinity) continue;
    RTCRayN_tfar(rays, args->N, i) = t;
    RTCHitN_geomID(hits, args->N, i) = args->geomID;
    RTCHitN_primID(hits, args->N, i) = args->primID;
    RTCHitN_instID(hits, args->N, i, 0) = args->context->instID[0];
  }
}

void analytic_occluded(const RTCOccludedFunctionNArguments* args) {
  const auto* shape = static_cast<const AnalyticShape*>(args->geometryUserPtr);
  for (unsigned i = 0; i < args->N; ++i)
    if (args->valid[i] && shape->intersect(to_ray(args->ray, args->N, i)) != kInfinity)
      RTCRayN_tfar(args->ray, args->N, i) = -kInfinity;
}

void set_mesh(RTCGeometry geometry, const TriangleMesh& mesh) {
  // Embree reads 16 bytes per vertex; a record is longer than that, so reading the last one is safe too.
  rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, mesh.vertices().data(), 0,
                             sizeof(TriangleMesh::Vertex), mesh.vertices().size());
  rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, mesh.triangles().data(), 0,
                             sizeof(mesh.triangles()[0]), mesh.triangles().size());
}

void set_analytic(RTCGeometry geometry, const AnalyticShape& shape) {
  rtcSetGeometryUserPrimitiveCount(geometry, 1);
  rtcSetGeometryUserData(geometry, const_cast<AnalyticShape*>(&shape));
  rtcSetGeometryBoundsFunction(geometry, analytic_bounds, nullptr);
  rtcSetGeometryIntersectFunction(geometry, analytic_intersect);
  rtcSetGeometryOccludedFunction(geometry, analytic_occluded);
}

/// Curves are visible from outside only, as in Mitsuba; in Embree, that is only a compile-time option.
void pass_from_inside(const RTCFilterFunctionNArguments* args) {
  for (unsigned i = 0; i < args->N; ++i) {
    if (!args->valid[i]) continue;
    const Vec3 d = to_ray(args->ray, args->N, i).d;
    const Vec3 n{RTCHitN_Ng_x(args->hit, args->N, i), RTCHitN_Ng_y(args->hit, args->N, i),
                 RTCHitN_Ng_z(args->hit, args->N, i)};
    if (dot(d, n) > 0) args->valid[i] = 0;
  }
}

/// Vertices are Embree's own copy, `scale` times as large.
void set_curve(RTCGeometry geometry, const CurveShape& curve, float scale = 1) {
  auto* points = static_cast<CurvePoint*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT4, sizeof(CurvePoint), curve.points().size()));
  for (const CurvePoint& point : curve.points())
    *points++ = {point[0] * scale, point[1] * scale, point[2] * scale, point[3] * scale};
  rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT, curve.segments().data(), 0,
                             sizeof(uint32_t), curve.segments().size());
  rtcSetGeometryIntersectFilterFunction(geometry, pass_from_inside);
  rtcSetGeometryOccludedFilterFunction(geometry, pass_from_inside);
}

RTCGeometryType type_of(const Shape& shape) {
  if (dynamic_cast<const TriangleMesh*>(&shape)) return RTC_GEOMETRY_TYPE_TRIANGLE;
  const auto* curve = dynamic_cast<const CurveShape*>(&shape);
  if (!curve) return RTC_GEOMETRY_TYPE_USER;
  return curve->kind() == CurveKind::kLinear ? RTC_GEOMETRY_TYPE_ROUND_LINEAR_CURVE
                                             : RTC_GEOMETRY_TYPE_ROUND_BSPLINE_CURVE;
}

}  // namespace

float enlargement(const Shape& shape) {
  constexpr float kLong = 0x1p40f;
  const auto* curve = dynamic_cast<const CurveShape*>(&shape);
  if (!curve || curve->kind() != CurveKind::kLinear) return 1;
  const float shortest = curve->shortest_segment();
  if (!(shortest < kShortSegment)) return 1;
  const float largest = max_component(max(abs(curve->bounds().lower), abs(curve->bounds().upper)));
  return std::ldexp(1.0f, -std::ilogb(std::max(shortest, largest / kLong)));
}

void set_shape(RTCGeometry geometry, const Shape& shape) {
  if (const auto* mesh = dynamic_cast<const TriangleMesh*>(&shape))
    set_mesh(geometry, *mesh);
  else if (const auto* curve = dynamic_cast<const CurveShape*>(&shape))
    set_curve(geometry, *curve);
  else
    set_analytic(geometry, dynamic_cast<const AnalyticShape&>(shape));
  rtcCommitGeometry(geometry);
}

void commit_scene(RTCScene scene) {
  run_outside([scene] { rtcCommitScene(scene); });
}

Transform rounded(const Transform& to_world) {
  Matrix4 m = to_world.matrix();
  for (auto& row : m)
    for (double& x : row) x = static_cast<float>(x);
  return Transform(m);
}

void set_placement(RTCGeometry geometry, const Transform& to_world) {
  float columns[12];
  for (int c = 0; c < 4; ++c)
    for (int r = 0; r < 3; ++r) columns[c * 3 + r] = static_cast<float>(to_world.matrix()[r][c]);
  rtcSetGeometryTransform(geometry, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, columns);
  rtcCommitGeometry(geometry);
}

namespace {

/// Sets an instance to a curve that is enlarged by `scale` inside it.
void set_enlarged(RTCDevice device, RTCGeometry instance, const CurveShape& curve, float scale) {
  const RTCScene scene = rtcNewScene(device);
  const RTCGeometry geometry = rtcNewGeometry(device, type_of(curve));
  set_curve(geometry, curve, scale);
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene, geometry);
  rtcReleaseGeometry(geometry);
  commit_scene(scene);
  rtcSetGeometryInstancedScene(instance, scene);
  rtcReleaseScene(scene);
  set_placement(instance, Transform::scale(Vec3{1, 1, 1} * (1 / scale)));
}

}  // namespace

RTCGeometry make_geometry(RTCDevice device, const Shape& shape, bool instanced) {
  const float scale = instanced ? 1 : enlargement(shape);
  const RTCGeometry geometry = rtcNewGeometry(device, scale == 1 ? type_of(shape) : RTC_GEOMETRY_TYPE_INSTANCE);
  if (scale == 1)
    set_shape(geometry, shape);
  else
    set_enlarged(device, geometry, dynamic_cast<const CurveShape&>(shape), scale);
  return geometry;
}

}  // namespace covary
