// SPDX-License-Identifier: Apache-2.0
#include <string>

#include "core/error.h"
#include "core/warp.h"
#include "scene/analytic_shape.h"

namespace covary {
namespace {

/// Common length of the transformed axes; throws unless they have equal lengths and are orthogonal.
float similarity_scale(const Transform& t) {
  const Vec3 x = t.vector({1, 0, 0}), y = t.vector({0, 1, 0}), z = t.vector({0, 0, 1});
  const float l = length(x), tolerance = 1e-3f * l;
  if (std::abs(length(y) - l) > tolerance || std::abs(length(z) - l) > tolerance ||
      std::abs(dot(x, y)) > tolerance * l || std::abs(dot(x, z)) > tolerance * l || std::abs(dot(y, z)) > tolerance * l)
    throw Error(ErrorCode::kInput, "the to_world transformation of a sphere must scale all axes alike, without shear");
  return l;
}

/// (phi / 2 pi, theta / pi) of a unit vector.
Vec2 spherical_uv(const Vec3& local) {
  const float rho = std::sqrt(local.x * local.x + local.y * local.y);
  return {angle_turns(local.y, local.x), 2 * angle_turns(rho, local.z)};
}

}  // namespace

Sphere::Sphere(const Transform& to_world, const Vec3& center, float radius, bool flip_normals)
    : to_world_(to_world * Transform::translate(center) * Transform::scale({radius, radius, radius})),
      center_(to_world_.point({0, 0, 0})),
      radius_(similarity_scale(to_world_)),
      sign_(flip_normals ? -1.0f : 1.0f) {
  for (int i = 0; i < 3; ++i)
    axes_[i] = normalize(to_world_.vector({i == 0 ? 1.0f : 0, i == 1 ? 1.0f : 0, i == 2 ? 1.0f : 0}));
}

Bounds3 Sphere::bounds() const {
  const Vec3 r{radius_, radius_, radius_};
  return {center_ - r, center_ + r};
}

float Sphere::intersect(const Ray& ray) const {
  // Double precision: for large spheres seen from far away, single precision is not enough.
  const double ox = double(ray.o.x) - center_.x, oy = double(ray.o.y) - center_.y, oz = double(ray.o.z) - center_.z;
  const double b = ox * ray.d.x + oy * ray.d.y + oz * ray.d.z;
  const double a = double(ray.d.x) * ray.d.x + double(ray.d.y) * ray.d.y + double(ray.d.z) * ray.d.z;
  const double c = ox * ox + oy * oy + oz * oz - double(radius_) * radius_;
  const double discriminant = b * b - a * c;
  if (discriminant < 0) return kInfinity;
  // The root with the larger magnitude first, the other from their product, to avoid cancellation.
  const double q = -(b + std::copysign(std::sqrt(discriminant), b));
  const double t0 = std::min(q / a, c / q), t1 = std::max(q / a, c / q);
  const double t = t0 > 0 ? t0 : t1;
  return t > 0 && t < ray.t_max ? static_cast<float>(t) : kInfinity;
}

void Sphere::fill(const Ray& ray, SurfaceHit& hit, bool with_derivatives) const {
  const Vec3 outward = normalize((ray.o - center_) + ray.d * hit.t);
  hit.p = center_ + outward * radius_;
  hit.ng = outward * sign_;
  hit.offset = surface_offset(hit.p, hit.ng, ball().slack());
  const Vec3 local = to_local(outward);
  const float rho = std::sqrt(local.x * local.x + local.y * local.y);
  hit.uv = spherical_uv(local);
  if (!with_derivatives) {
    hit.frame = Frame(hit.ng);
    return;
  }
  const float inverse_rho = rho > 0 ? 1 / rho : 0;
  hit.dp_du = to_world_.vector(Vec3{-local.y, local.x, 0} * kTwoPi);
  hit.dp_dv = rho > 0
                  ? to_world_.vector(Vec3{local.z * local.x * inverse_rho, local.z * local.y * inverse_rho, -rho} * kPi)
                  : to_world_.vector({kPi, 0, 0});
  hit.frame = Frame::from_tangent(hit.ng, hit.dp_du);
}

std::shared_ptr<Shape> Sphere::transformed(const Transform& to_world) const {
  return std::make_shared<Sphere>(to_world * to_world_, Vec3{}, 1.0f, sign_ < 0);
}

AreaSample Sphere::sample_area(Vec2 u, float /*u_primitive*/) const {
  const Vec3 d = warp::square_to_sphere(u);
  return {center_ + d * radius_, d * sign_, spherical_uv(to_local(d)), 1 / area(), 0, {}, ball().slack()};
}

EmitterSample Sphere::sample_towards(const Vec3& reference, Vec2 u, float u_primitive) const {
  const Ball seen = ball();
  const float sin2_max = seen.squared_sine(reference);
  if (!(sin2_max < 1)) return Shape::sample_towards(reference, u, u_primitive);
  const float one_minus_cos_max = Ball::one_minus_cos(sin2_max);
  EmitterSample sample;
  sample.wi = seen.direction(reference, warp::square_to_cone(u, one_minus_cos_max));
  sample.distance = seen.distance(reference, sample.wi);
  const Vec3 outward = seen.outward(reference, sample.wi, sample.distance);
  sample.p = center_ + outward * radius_;
  sample.n = outward * sign_;
  sample.offset = surface_offset(sample.p, sample.n, seen.slack());
  // Not needed for constant emission, in which case the light's power is known.
  if (!emitter() || !emitter()->knows_power()) sample.uv = spherical_uv(to_local(outward));
  sample.pdf_solid_angle = warp::cone_pdf_solid_angle(one_minus_cos_max);
  return sample;
}

float Sphere::pdf_solid_angle(const Vec3& reference, const SurfaceHit& hit) const {
  const float sin2_max = ball().squared_sine(reference);
  if (!(sin2_max < 1)) return Shape::pdf_solid_angle(reference, hit);
  return warp::cone_pdf_solid_angle(Ball::one_minus_cos(sin2_max));
}

}  // namespace covary
