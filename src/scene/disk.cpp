// SPDX-License-Identifier: Apache-2.0
#include "core/warp.h"
#include "scene/analytic_shape.h"

namespace covary {

Disk::Disk(const Transform& to_world, bool flip_normals)
    : to_world_(to_world),
      to_local_(to_world.inverse()),
      normal_(normalize(to_world.normal({0, 0, flip_normals ? -1.0f : 1.0f}))),
      area_(kPi * length(cross(to_world.vector({1, 0, 0}), to_world.vector({0, 1, 0})))),
      flipped_(flip_normals) {}

Bounds3 Disk::bounds() const { return to_world_.bounds({{-1, -1, 0}, {1, 1, 0}}); }

float Disk::intersect(const Ray& ray) const {
  const Vec3 o = to_local_.point(ray.o), d = to_local_.vector(ray.d);
  const float t = -o.z / d.z;
  if (!(t > 0 && t < ray.t_max)) return kInfinity;
  const float x = o.x + t * d.x, y = o.y + t * d.y;
  return x * x + y * y <= 1 ? t : kInfinity;
}

void Disk::fill(const Ray& ray, SurfaceHit& hit, bool with_derivatives) const {
  Vec3 local = to_local_.point(ray.o) + to_local_.vector(ray.d) * hit.t;
  local.z = 0;
  hit.p = to_world_.point(local);
  hit.ng = normal_;
  hit.offset = surface_offset(hit.p, hit.ng, 0);  // the point is transformed in double precision, as rays are
  const float r = std::sqrt(local.x * local.x + local.y * local.y);
  hit.uv = {r, angle_turns(local.y, local.x)};
  if (!with_derivatives) {
    hit.frame = Frame(normal_);
    return;
  }
  const float c = r > 0 ? local.x / r : 1, s = r > 0 ? local.y / r : 0;
  hit.dp_du = to_world_.vector({c, s, 0});
  hit.dp_dv = to_world_.vector(Vec3{-s, c, 0} * (kTwoPi * r));
  hit.frame = Frame::from_tangent(normal_, hit.dp_du);
}

std::shared_ptr<Shape> Disk::transformed(const Transform& to_world) const {
  return std::make_shared<Disk>(to_world * to_world_, flipped_);
}

AreaSample Disk::sample_area(Vec2 u, float /*u_primitive*/) const {
  const Vec2 d = warp::square_to_disk(u);
  return {to_world_.point({d.x, d.y, 0}), normal_, {std::sqrt(dot(d, d)), angle_turns(d.y, d.x)}, 1 / area_};
}

}  // namespace covary
