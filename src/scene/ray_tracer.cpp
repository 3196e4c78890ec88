// SPDX-License-Identifier: Apache-2.0
#include "scene/ray_tracer.h"

// CMakeLists.txt also prefers Embree 4 if both are installed.
#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include <algorithm>
#include <map>
#include <string>

#include "core/detached_work.h"
#include "core/error.h"
#include "scene/analytic_shape.h"
#include "scene/curve.h"
#include "scene/mesh.h"

namespace covary {
namespace {

void on_embree_error(void*, RTCError code, const char* text) {
  throw Error(ErrorCode::kInternal, "Embree error " + std::to_string(code) + ": " + (text ? text : "no description"));
}

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

void set_curve(RTCGeometry geometry, const CurveShape& curve) {
  rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT4, curve.points().data(), 0,
                             sizeof(CurvePoint), curve.points().size());
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

/// Sets the geometry, which must be of the shape's type, to the shape.
void set_shape(RTCGeometry geometry, const Shape& shape) {
  if (const auto* mesh = dynamic_cast<const TriangleMesh*>(&shape))
    set_mesh(geometry, *mesh);
  else if (const auto* curve = dynamic_cast<const CurveShape*>(&shape))
    set_curve(geometry, *curve);
  else
    set_analytic(geometry, dynamic_cast<const AnalyticShape&>(shape));
  rtcCommitGeometry(geometry);
}

/// The transformation as Embree has it, in floats.
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

/// Rays are passed to Embree in packets: camera rays gain most, scattered ones a little; single ones lose little.
constexpr size_t kPacket = 16;

/// Sets the fields that are the same for all rays and unchanged by Embree.
void begin_packet(RTCRay16& packet) {
  for (size_t i = 0; i < kPacket; ++i)
    packet.tnear[i] = 0, packet.time[i] = 0, packet.mask[i] = ~0u, packet.id[i] = 0, packet.flags[i] = 0;
}

void set_ray(RTCRay16& packet, size_t i, const Ray& ray) {
  packet.org_x[i] = ray.o.x, packet.org_y[i] = ray.o.y, packet.org_z[i] = ray.o.z;
  packet.dir_x[i] = ray.d.x, packet.dir_y[i] = ray.d.y, packet.dir_z[i] = ray.d.z;
  packet.tfar[i] = ray.t_max;
}

/// Query arguments: Embree 3 has them in the context, Embree 4 separately.
class Query {
 public:
#if RTC_VERSION_MAJOR >= 4
  explicit Query(bool coherent) {
    rtcInitRayQueryContext(&context_);
    rtcInitIntersectArguments(&nearest_);
    rtcInitOccludedArguments(&occluded_);
    nearest_.flags = coherent ? RTC_RAY_QUERY_FLAG_COHERENT : RTC_RAY_QUERY_FLAG_INCOHERENT;
    nearest_.context = occluded_.context = &context_;
  }
  void nearest(const int* valid, RTCScene scene, RTCRayHit16& packet) {
    rtcIntersect16(valid, scene, &packet, &nearest_);
  }
  void occluded(const int* valid, RTCScene scene, RTCRay16& packet) {
    rtcOccluded16(valid, scene, &packet, &occluded_);
  }

 private:
  RTCRayQueryContext context_;
  RTCIntersectArguments nearest_;
  RTCOccludedArguments occluded_;
#else
  explicit Query(bool coherent) {
    rtcInitIntersectContext(&context_);
    context_.flags = coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
  }
  void nearest(const int* valid, RTCScene scene, RTCRayHit16& packet) {
    rtcIntersect16(valid, scene, &context_, &packet);
  }
  void occluded(const int* valid, RTCScene scene, RTCRay16& packet) { rtcOccluded16(valid, scene, &context_, &packet); }

 private:
  RTCIntersectContext context_;
#endif
};

/// Bound of errors along each axis, in units of kRounding, when Embree transforms rays from world space: it computes in
/// floats, with an inverse that it computes in floats, too.
Vec3 slack_of(const Transform& to_world, const Bounds3& world) {
  const Matrix4 m = to_world.matrix(), inverse = to_world.inverse().matrix();
  Vec3 slack;
  for (int k = 0; k < 3; ++k) {
    const double t = m[k][3], far = std::max(std::abs(world.lower[k] - t), std::abs(world.upper[k] - t));
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        slack[i] += static_cast<float>(4 * std::abs(m[i][j] * inverse[j][k]) * (std::abs(t) + far));
  }
  return slack;
}

/// Transforms a hit in a group's space to world space.
void place(SurfaceHit& hit, const Transform& to_world, const Vec3& slack, bool with_derivatives) {
  hit.p = to_world.point(hit.p);
  const Vec3 normal = to_world.normal(hit.ng);
  const float inverse = 1 / length(normal);  // by this, distances along the normal grow
  hit.ng = normal * inverse;
  hit.offset = hit.offset * inverse + surface_offset(hit.p, hit.ng, dot(slack, abs(hit.ng)));
  const Vec3 n = normalize(to_world.normal(hit.frame.n));
  if (!with_derivatives) {
    hit.frame = Frame(n);
    return;
  }
  hit.dp_du = to_world.vector(hit.dp_du);
  hit.dp_dv = to_world.vector(hit.dp_dv);
  hit.frame = Frame::from_tangent(n, hit.dp_du);
}

/// Builds the hierarchy; outside of the surrounding work, because each of Embree's scenes keeps a task group.
void commit_scene(RTCScene scene) {
  run_outside([scene] { rtcCommitScene(scene); });
}

void release(RTCDevice device, RTCScene top, const auto& groups) {
  if (top) rtcReleaseScene(top);
  for (const auto& group : groups) rtcReleaseScene(group.scene);
  rtcReleaseDevice(device);
}

}  // namespace

RayTracer::Group RayTracer::make_group(std::span<const ShapePtr> shapes, bool moves) const {
  Group group;
  group.scene = rtcNewScene(device_);
  // According to Embree's manual, "low" quality builds a separate hierarchy (of medium quality) per geometry.
  rtcSetSceneBuildQuality(group.scene, moves ? RTC_BUILD_QUALITY_LOW : RTC_BUILD_QUALITY_MEDIUM);
  if (moves) rtcSetSceneFlags(group.scene, RTC_SCENE_FLAG_DYNAMIC);
  for (const ShapePtr& shape : shapes) {
    const RTCGeometry geometry = rtcNewGeometry(device_, type_of(*shape));
    set_shape(geometry, *shape);
    rtcAttachGeometryByID(group.scene, geometry, static_cast<unsigned>(group.shapes.size()));
    rtcReleaseGeometry(geometry);
    group.shapes.push_back(shape.get());
    group.meshes.push_back(dynamic_cast<const TriangleMesh*>(shape.get()));
  }
  return group;
}

RayTracer::RayTracer(std::span<const ShapePtr> shapes, std::span<const Instance> instances, bool moves)
    : device_(rtcNewDevice(nullptr)) {
  if (!device_)
    throw Error(ErrorCode::kIo,
                rtcGetDeviceError(nullptr) == RTC_ERROR_OUT_OF_MEMORY
                    ? "out of memory: Embree's device"
                    : "Embree cannot make a device: too little memory, too few threads allowed, or another processor");
  rtcSetDeviceErrorFunction(device_, on_embree_error, nullptr);
  try {
    top_ = make_group(shapes, moves);

    std::map<const ShapeGroup*, size_t> index;
    for (const Instance& instance : instances)
      if (index.emplace(instance.group.get(), groups_.size()).second) {
        groups_.push_back(make_group(instance.group->shapes));
        commit_scene(groups_.back().scene);
      }
    for (const Instance& instance : instances) {
      const Group& group = groups_[index.at(instance.group.get())];
      const RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_INSTANCE);
      rtcSetGeometryInstancedScene(geometry, group.scene);
      set_placement(geometry, instance.to_world);
      rtcAttachGeometryByID(top_.scene, geometry, static_cast<unsigned>(top_.shapes.size() + placed_.size()));
      rtcReleaseGeometry(geometry);
      placed_.push_back(placed_at(group, instance.to_world));
    }
    commit_scene(top_.scene);
  } catch (...) {  // out of memory
    release(device_, top_.scene, groups_);
    throw;
  }
}

RayTracer::Placed RayTracer::placed_at(const Group& group, const Transform& to_world) {
  Bounds3 bounds;
  for (const Shape* shape : group.shapes) bounds.extend(to_world.bounds(shape->bounds()));
  return {&group, rounded(to_world), slack_of(to_world, bounds)};
}

RayTracer::~RayTracer() { release(device_, top_.scene, groups_); }

void RayTracer::move_shape(size_t index, const Shape& shape) {
  set_shape(rtcGetGeometry(top_.scene, static_cast<unsigned>(index)), shape);
  top_.shapes[index] = &shape;
  top_.meshes[index] = dynamic_cast<const TriangleMesh*>(&shape);
}

void RayTracer::move_instance(size_t index, const Transform& to_world) {
  set_placement(rtcGetGeometry(top_.scene, static_cast<unsigned>(top_.shapes.size() + index)), to_world);
  placed_[index] = placed_at(*placed_[index].group, to_world);
}

void RayTracer::commit() { commit_scene(top_.scene); }

void RayTracer::nearest(std::span<const Ray> rays, std::span<RayHit> hits, bool coherent) const {
  Query query(coherent);
  RTCRayHit16 packet;
  begin_packet(packet.ray);
  for (size_t first = 0; first < rays.size(); first += kPacket) {
    const size_t n = std::min(kPacket, rays.size() - first);
    alignas(64) int valid[kPacket];
    for (size_t i = 0; i < kPacket; ++i) {
      valid[i] = i < n ? -1 : 0;
      set_ray(packet.ray, i, rays[first + std::min(i, n - 1)]);
      packet.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
      packet.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
    }
    query.nearest(valid, top_.scene, packet);
    for (size_t i = 0; i < n; ++i)
      hits[first + i] = {packet.ray.tfar[i],
                         {packet.hit.u[i], packet.hit.v[i]},
                         packet.hit.primID[i],
                         packet.hit.geomID[i],
                         packet.hit.instID[0][i]};
    // Prefetch what resolve() reads of a mesh: the triangles here, their vertices below.
    for (size_t i = first; i < first + n; ++i)
      if (const TriangleMesh* mesh = mesh_of(hits[i])) __builtin_prefetch(&mesh->triangles()[hits[i].primitive]);
  }
  for (const RayHit& hit : hits.first(rays.size()))
    if (const TriangleMesh* mesh = mesh_of(hit))
      for (const uint32_t index : mesh->triangles()[hit.primitive]) __builtin_prefetch(&mesh->vertices()[index]);
}

void RayTracer::occluded(std::span<const Ray> rays, std::span<uint8_t> blocked) const {
  Query query(false);
  RTCRay16 packet;
  begin_packet(packet);
  for (size_t first = 0; first < rays.size(); first += kPacket) {
    const size_t n = std::min(kPacket, rays.size() - first);
    alignas(64) int valid[kPacket];
    for (size_t i = 0; i < kPacket; ++i) {
      valid[i] = i < n ? -1 : 0;
      set_ray(packet, i, rays[first + std::min(i, n - 1)]);
    }
    query.occluded(valid, top_.scene, packet);
    for (size_t i = 0; i < n; ++i) blocked[first + i] = packet.tfar[i] < 0;
  }
}

void RayTracer::resolve(const Ray& ray, const RayHit& found, SurfaceHit& hit) const {
  const Placed* placed = found.instance == RayHit::kNone ? nullptr : &placed_[found.instance - top_.shapes.size()];
  const Shape* shape = (placed ? *placed->group : top_).shapes[found.geometry];
  hit.t = found.t;
  hit.primitive = found.primitive;
  hit.barycentric = found.barycentric;
  hit.shape = shape, hit.bsdf = shape->bsdf(), hit.bsdf_flags = shape->bsdf_flags(), hit.emitter = shape->emitter();
  const bool with_derivatives = shape->needs_derivatives();
  if (!placed) {
    shape->fill(ray, hit, with_derivatives);
  } else {
    const Transform to_local = placed->to_world.inverse();
    shape->fill({to_local.point(ray.o), to_local.vector(ray.d), ray.t_max}, hit, with_derivatives);
    place(hit, placed->to_world, placed->slack, with_derivatives);
  }
}

}  // namespace covary
