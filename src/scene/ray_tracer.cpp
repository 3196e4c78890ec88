// SPDX-License-Identifier: Apache-2.0
#include "scene/ray_tracer.h"

#include <algorithm>
#include <map>
#include <string>
#include <utility>

#include "core/error.h"
#include "scene/embree_geometry.h"
#include "scene/mesh.h"

namespace covary {
namespace {

void on_embree_error(void*, RTCError code, const char* text) {
  throw Error(ErrorCode::kInternal, "Embree error " + std::to_string(code) + ": " + (text ? text : "no description"));
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

/// Whether rays pass through it: a light that shines unseen.
bool is_hidden(const Shape& shape) { return shape.emitter() && shape.emitter()->is_delta_position(); }

void release(RTCDevice device, RTCScene top, const auto& groups) {
  if (top) rtcReleaseScene(top);
  for (const auto& group : groups) rtcReleaseScene(group.scene);
  rtcReleaseDevice(device);
}

}  // namespace

RayTracer::Group RayTracer::make_group(std::span<const ShapePtr> shapes, bool instanced, bool moves) const {
  Group group;
  group.scene = rtcNewScene(device_);
  // According to Embree's manual, "low" quality builds a separate hierarchy (of medium quality) per geometry.
  rtcSetSceneBuildQuality(group.scene, moves ? RTC_BUILD_QUALITY_LOW : RTC_BUILD_QUALITY_MEDIUM);
  if (moves) rtcSetSceneFlags(group.scene, RTC_SCENE_FLAG_DYNAMIC);
  for (const ShapePtr& shape : shapes) {
    if (!is_hidden(*shape)) {
      const RTCGeometry geometry = make_geometry(device_, *shape, instanced);
      rtcAttachGeometryByID(group.scene, geometry, static_cast<unsigned>(group.shapes.size()));
      rtcReleaseGeometry(geometry);
    }
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
    top_ = make_group(shapes, false, moves);

    std::map<const ShapeGroup*, size_t> index;
    for (const Instance& instance : instances)
      if (index.emplace(instance.group.get(), groups_.size()).second) {
        groups_.push_back(make_group(instance.group->shapes, true, false));
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
  if (is_hidden(shape)) {
    // Rays do not meet it.
  } else if (const float scale = enlargement(shape); scale == 1 && enlargement(*top_.shapes[index]) == 1) {
    set_shape(rtcGetGeometry(top_.scene, static_cast<unsigned>(index)), shape);
  } else {
    rtcDetachGeometry(top_.scene, static_cast<unsigned>(index));
    const RTCGeometry geometry = make_geometry(device_, shape, false);
    rtcAttachGeometryByID(top_.scene, geometry, static_cast<unsigned>(index));
    rtcReleaseGeometry(geometry);
  }
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
    for (size_t i = 0; i < n; ++i) {
      RayHit& hit = hits[first + i];
      hit = {packet.ray.tfar[i],
             {packet.hit.u[i], packet.hit.v[i]},
             packet.hit.primID[i],
             packet.hit.geomID[i],
             packet.hit.instID[0][i]};
      // A shape that is an instance of itself.
      if (hit.instance < top_.shapes.size()) hit.geometry = std::exchange(hit.instance, RayHit::kNone);
    }
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
