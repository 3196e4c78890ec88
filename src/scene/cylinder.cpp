// SPDX-License-Identifier: Apache-2.0
#include "core/error.h"
#include "core/trigonometry.h"
#include "scene/analytic_shape.h"

namespace covary {
namespace {

/// Axes orthogonal to the unit vector n [Duff2017]. Unlike those of Frame they jump where n.z changes sign, but they
/// are Mitsuba's, and textures start at the first axis.
Frame axes_around(const Vec3& n) {
  const float sign = std::copysign(1.0f, n.z), a = -1 / (sign + n.z), b = n.x * n.y * a;
  return {{1 + sign * n.x * n.x * a, sign * b, -sign * n.x}, {b, sign + n.y * n.y * a, -n.y}, n};
}

Transform unit_cylinder_to_world(const Transform& to_world, const Vec3& p0, const Vec3& p1, float radius) {
  const Vec3 axis = p1 - p0;
  const float l = length(axis);
  if (!(l > 0)) throw Error(ErrorCode::kInput, "the end points of a cylinder are the same");
  const Frame frame = axes_around(axis * (1 / l));
  Matrix4 m{};
  for (int i = 0; i < 3; ++i)
    m[i][0] = frame.s[i] * radius, m[i][1] = frame.t[i] * radius, m[i][2] = axis[i], m[i][3] = p0[i];
  m[3][3] = 1;
  return to_world * Transform(m);
}

}  // namespace

Cylinder::Cylinder(const Transform& to_world, const Vec3& p0, const Vec3& p1, float radius, bool flip_normals)
    : Cylinder(unit_cylinder_to_world(to_world, p0, p1, radius), flip_normals) {}

Cylinder::Cylinder(const Transform& to_world, bool flip_normals)
    : to_world_(to_world), to_local_(to_world_.inverse()), sign_(flip_normals ? -1.0f : 1.0f) {
  const Vec3 x = to_world_.vector({1, 0, 0}), y = to_world_.vector({0, 1, 0}), z = to_world_.vector({0, 0, 1});
  const float r = length(x);
  if (std::abs(length(y) - r) > 1e-3f * r || std::abs(dot(x, y)) > 1e-3f * r * r ||
      std::abs(dot(x, z)) > 1e-3f * r * length(z) || std::abs(dot(y, z)) > 1e-3f * r * length(z))
    throw Error(
        ErrorCode::kInput,
        "the to_world transformation of a cylinder must keep its cross section a circle at right angles to the axis");
  area_ = kTwoPi * r * length(z);
  slack_ = 8 * r;  // roundings of rays and points to floats in the space of the unit cylinder
}

Bounds3 Cylinder::bounds() const { return to_world_.bounds({{-1, -1, 0}, {1, 1, 1}}); }

float Cylinder::intersect(const Ray& ray) const {
  const Vec3 of = to_local_.point(ray.o), df = to_local_.vector(ray.d);
  const double ox = of.x, oy = of.y, dx = df.x, dy = df.y;
  const double a = dx * dx + dy * dy, b = ox * dx + oy * dy, c = ox * ox + oy * oy - 1;
  const double discriminant = b * b - a * c;
  if (!(discriminant >= 0) || a == 0) return kInfinity;
  const double q = -(b + std::copysign(std::sqrt(discriminant), b));
  const double roots[2] = {std::min(q / a, c / q), std::max(q / a, c / q)};
  for (double t : roots) {
    const double z = of.z + t * df.z;
    if (t > 0 && t < ray.t_max && z >= 0 && z <= 1) return static_cast<float>(t);
  }
  return kInfinity;
}

void Cylinder::fill(const Ray& ray, SurfaceHit& hit, bool with_derivatives) const {
  Vec3 local = to_local_.point(ray.o) + to_local_.vector(ray.d) * hit.t;
  const float inverse_r = 1 / std::sqrt(local.x * local.x + local.y * local.y);
  local.x *= inverse_r, local.y *= inverse_r;
  hit.p = to_world_.point(local);
  hit.ng = normalize(to_world_.normal({local.x, local.y, 0})) * sign_;
  hit.offset = surface_offset(hit.p, hit.ng, slack_);
  hit.uv = {angle_turns(local.y, local.x), local.z};
  if (!with_derivatives) {
    hit.frame = Frame(hit.ng);
    return;
  }
  hit.dp_du = to_world_.vector(Vec3{-local.y, local.x, 0} * kTwoPi);
  hit.dp_dv = to_world_.vector({0, 0, 1});
  hit.frame = Frame::from_tangent(hit.ng, hit.dp_du);
}

std::shared_ptr<Shape> Cylinder::transformed(const Transform& to_world) const {
  return std::make_shared<Cylinder>(to_world * to_world_, sign_ < 0);
}

AreaSample Cylinder::sample_area(Vec2 u, float /*u_primitive*/) const {
  const float phi = kTwoPi * u.x, c = std::cos(phi), s = std::sin(phi);
  return {to_world_.point({c, s, u.y}), normalize(to_world_.normal({c, s, 0})) * sign_, u, 1 / area_, 0, {}, slack_};
}

}  // namespace covary
