// SPDX-License-Identifier: Apache-2.0
// pbrt's quadrics (shapes.h; cones, paraboloids and hyperboloids of version 3). Whole spheres, disks and cylinders are
// shapes of their own; parts of them, and unevenly scaled ones, become fine meshes with exact normals and pbrt's u, v.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "pbrt/pbrt_objects.h"

namespace covary {
namespace {

/// pbrt's normals of quadrics point to the other side under a mirroring transformation (shapes.h: flipNormal), those of
/// meshes do not.
bool flips_quadric(const PbrtPlacement& placement) {
  return placement.reverse_orientation != placement.to_world.flips_handedness();
}

ObjectBuilder shape(const std::string& type, PbrtParameters& p, const PbrtPlacement& placement,
                    const Transform& own = Transform()) {
  auto result = make_object("shape", type, p.where(), {{"to_world", placement.to_world * own}});
  if (flips_quadric(placement)) set_property(*result, "flip_normals", true);
  return result;
}

/// Whether all axes keep their angles and are scaled alike.
bool is_similarity(const Transform& t) {
  const Vec3 x = t.vector({1, 0, 0}), y = t.vector({0, 1, 0}), z = t.vector({0, 0, 1});
  const float l = length(x), tolerance = 1e-3f * l;
  return std::abs(length(y) - l) <= tolerance && std::abs(length(z) - l) <= tolerance &&
         std::abs(dot(x, y)) <= tolerance * l && std::abs(dot(x, z)) <= tolerance * l &&
         std::abs(dot(y, z)) <= tolerance * l;
}

/// The curve that is turned around the z axis: (x, y, z) at v in [0, 1].
struct Profile {
  std::function<std::array<double, 3>(double v)> at;
  int steps;           ///< of v
  double phi_degrees;  ///< how far it is turned
};

struct Vertex {
  std::array<double, 3> p, n;
};
Vertex turned(const Profile& profile, double u, double v) {
  constexpr double kStep = 1e-6;
  const double phi = u * profile.phi_degrees * M_PI / 180, c = std::cos(phi), s = std::sin(phi);
  const auto turn = [&](const std::array<double, 3>& q) {
    return std::array<double, 3>{c * q[0] - s * q[1], s * q[0] + c * q[1], q[2]};
  };
  const std::array<double, 3> q = turn(profile.at(v));
  // dp/dv by differences inside of [0, 1]; at the axis, dp/du is that of a point beside it.
  const double v0 = std::max(v - kStep, 0.0), v1 = std::min(v + kStep, 1.0);
  const std::array<double, 3> a = turn(profile.at(v0)), b = turn(profile.at(v1));
  const std::array<double, 3> dv = {b[0] - a[0], b[1] - a[1], b[2] - a[2]};
  const bool on_axis = std::hypot(q[0], q[1]) < 1e-12;
  const std::array<double, 3> beside = on_axis ? turn(profile.at(v < 0.5 ? v + kStep : v - kStep)) : q;
  const double du[2] = {-beside[1], beside[0]};
  std::array<double, 3> n = {du[1] * dv[2], -du[0] * dv[2], du[0] * dv[1] - du[1] * dv[0]};
  const double l = std::hypot(n[0], n[1], n[2]);
  for (double& x : n) x = l > 0 ? x / l : 0;
  if (!(l > 0)) n[2] = 1;
  return {q, n};
}

PbrtShape mesh_of(const Profile& profile, PbrtParameters& p, const PbrtPlacement& placement) {
  const int nu = std::max(3, static_cast<int>(std::ceil(256 * profile.phi_degrees / 360))), nv = profile.steps;
  EmbeddedMesh mesh;
  for (int j = 0; j <= nv; ++j)
    for (int i = 0; i <= nu; ++i) {
      const double u = static_cast<double>(i) / nu, v = static_cast<double>(j) / nv;
      const Vertex vertex = turned(profile, u, v);
      mesh.positions.insert(mesh.positions.end(), vertex.p.begin(), vertex.p.end());
      mesh.normals.insert(mesh.normals.end(), vertex.n.begin(), vertex.n.end());
      mesh.uvs.push_back(u), mesh.uvs.push_back(v);
    }
  const auto on_axis = [&](int j) {
    const std::array<double, 3> q = profile.at(static_cast<double>(j) / nv);
    return std::hypot(q[0], q[1]) < 1e-9;
  };
  for (int j = 0; j < nv; ++j)
    for (int i = 0; i < nu; ++i) {
      const double a = j * (nu + 1) + i, c = a + nu + 1;
      if (!on_axis(j)) mesh.corners.insert(mesh.corners.end(), {a, a + 1, c + 1});
      if (!on_axis(j + 1)) mesh.corners.insert(mesh.corners.end(), {a, c + 1, c});
    }
  PbrtPlacement sides = placement;
  sides.reverse_orientation = flips_quadric(placement);
  return pbrt_mesh_shape(p, sides, mesh);
}

bool is_near(double value, double whole) { return std::abs(value - whole) <= 1e-4 * std::max(std::abs(whole), 1e-30); }

/// False after an error.
bool positive(PbrtParameters& p, const char* name, double value) {
  if (value > 0) return true;
  p.error(fmt::format("has {} {}; it must be positive", name, value));
  return false;
}

double turn_of(PbrtParameters& p) { return std::clamp(p.get_float("phimax", 360), 0.0, 360.0); }

/// Never mirrored: Mitsuba's normals depend on that, ours do not. Half turned and mirrored, it has pbrt's coordinates.
PbrtShape sphere(PbrtParameters& p, const PbrtPlacement& placement) {
  const double radius = p.get_float("radius", 1);
  const double z0 = p.get_float("zmin", -radius), z1 = p.get_float("zmax", radius), phi = turn_of(p);
  if (!positive(p, "radius", radius)) return {};
  const double low = std::clamp(std::min(z0, z1), -radius, radius),
               high = std::clamp(std::max(z0, z1), -radius, radius);
  if (is_near(phi, 360) && is_near(low, -radius) && is_near(high, radius) && is_similarity(placement.to_world)) {
    const bool mirrored = placement.to_world.flips_handedness();
    ObjectBuilder result = shape("sphere", p, placement, mirrored ? Transform::scale({1, 1, -1}) : Transform());
    set_property(*result, "radius", radius);
    return {result, mirrored ? PbrtUv::kOwn : PbrtUv::kSphere};
  }
  if (!(low < high) || !(phi > 0)) {
    p.error(fmt::format("is empty: zmin {}, zmax {}, phimax {}", z0, z1, phi));
    return {};
  }
  const double theta0 = std::acos(low / radius), theta1 = std::acos(high / radius);
  return mesh_of({[=](double v) {
                    const double theta = theta0 + v * (theta1 - theta0);
                    return std::array<double, 3>{radius * std::abs(std::sin(theta)), 0, radius * std::cos(theta)};
                  },
                  std::max(2, static_cast<int>(std::ceil(128 * (theta0 - theta1) / M_PI))), phi},
                 p, placement);
}

PbrtShape disk(PbrtParameters& p, const PbrtPlacement& placement) {
  const double radius = p.get_float("radius", 1), height = p.get_float("height", 0),
               inner = p.get_float("innerradius", 0), phi = turn_of(p);
  if (!positive(p, "radius", radius)) return {};
  if (is_near(phi, 360) && inner <= 0) {
    const auto r = static_cast<float>(radius);
    return {shape("disk", p, placement,
                  Transform::translate({0, 0, static_cast<float>(height)}) * Transform::scale({r, r, 1})),
            PbrtUv::kDisk};
  }
  return mesh_of({[=](double v) {
                    return std::array<double, 3>{radius + v * (inner - radius), 0, height};
                  },
                  1, phi},
                 p, placement);
}

PbrtShape cylinder(PbrtParameters& p, const PbrtPlacement& placement) {
  const double radius = p.get_float("radius", 1), z0 = p.get_float("zmin", -1), z1 = p.get_float("zmax", 1),
               phi = turn_of(p), low = std::min(z0, z1), high = std::max(z0, z1);
  if (!positive(p, "radius", radius)) return {};
  if (is_near(phi, 360) && is_similarity(placement.to_world)) {
    ObjectBuilder result = shape("cylinder", p, placement);
    set_property(*result, "radius", radius);
    set_property(*result, "p0", Vec3{0, 0, static_cast<float>(low)});
    set_property(*result, "p1", Vec3{0, 0, static_cast<float>(high)});
    return {result};
  }
  return mesh_of({[=](double v) {
                    return std::array<double, 3>{radius, 0, low + v * (high - low)};
                  },
                  1, phi},
                 p, placement);
}

PbrtShape cone(PbrtParameters& p, const PbrtPlacement& placement) {
  const double radius = p.get_float("radius", 1), height = p.get_float("height", 1);
  if (!positive(p, "radius", radius)) return {};
  return mesh_of({[=](double v) {
                    return std::array<double, 3>{radius * (1 - v), 0, height * v};
                  },
                  1, turn_of(p)},
                 p, placement);
}

PbrtShape paraboloid(PbrtParameters& p, const PbrtPlacement& placement) {
  const double radius = p.get_float("radius", 1), z0 = p.get_float("zmin", 0), z1 = p.get_float("zmax", 1),
               low = std::max(std::min(z0, z1), 0.0), high = std::max(z0, z1);
  if (!positive(p, "radius", radius) || !positive(p, "zmax", high)) return {};
  return mesh_of({[=](double v) {
                    const double z = low + v * (high - low);
                    return std::array<double, 3>{radius * std::sqrt(z / high), 0, z};
                  },
                  64, turn_of(p)},
                 p, placement);
}

PbrtShape hyperboloid(PbrtParameters& p, const PbrtPlacement& placement) {
  const Vec3 p1 = p.get_vec3("p1", {0, 0, 0}), p2 = p.get_vec3("p2", {1, 1, 1});
  return mesh_of({[=](double v) {
                    const auto at = [&](double a, double b) { return a + v * (b - a); };
                    return std::array<double, 3>{at(p1.x, p2.x), at(p1.y, p2.y), at(p1.z, p2.z)};
                  },
                  64, turn_of(p)},
                 p, placement);
}

}  // namespace

PbrtShape make_pbrt_quadric(const std::string& type, PbrtParameters& p, const PbrtPlacement& placement) {
  if (type == "sphere") return sphere(p, placement);
  if (type == "disk") return disk(p, placement);
  if (type == "cylinder") return cylinder(p, placement);
  if (type == "cone") return cone(p, placement);
  if (type == "paraboloid") return paraboloid(p, placement);
  return hyperboloid(p, placement);
}

}  // namespace covary
