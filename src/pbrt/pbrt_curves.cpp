// SPDX-License-Identifier: Apache-2.0
// pbrt curves as tubes around cubic B-splines; a curve of several segments becomes one spline, or one per segment.
// Ribbons, whose sides are given, become strips of triangles.
//
// A Bezier segment b0 … b3 is the B-spline segment with control points 6 b0 - 7 b1 + 2 b2, 2 b1 - b2, 2 b2 - b1 and 2
// b1 - 7 b2 + 6 b3; a radius varying linearly from r0 to r1 has control values r0 - d, r0, r1, r1 + d with d = r1 - r0.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "pbrt/pbrt_objects.h"
#include "scene/embedded_data.h"

namespace covary {
namespace {

using Point = std::array<double, 3>;

Point mix(std::initializer_list<std::pair<double, Point>> terms) {
  Point sum{};
  for (const auto& [weight, point] : terms)
    for (size_t k = 0; k < 3; ++k) sum[k] += weight * point[k];
  return sum;
}

/// Writes transformed curves.
class CurveText {
 public:
  explicit CurveText(const Transform& to_world) : to_world_(to_world) {
    const Matrix4& m = to_world.matrix();
    const double volume = m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) -
                          m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
                          m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
    scale_ = std::cbrt(std::abs(volume));
  }
  /// Negative radii, as beyond a tip, become 0.
  void add(const Point& p, double radius) {
    const Vec3 placed = to_world_.point({static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2])});
    text += fmt::format("{} {} {} {}\n", placed.x, placed.y, placed.z, std::max(radius, 0.0) * scale_);
  }
  void end() { text += "\n"; }
  /// Subdivided towards a tip, because the last piece keeps a sixth of its first radius.
  void add_bezier(const std::array<Point, 4>& b, double r0, double r1, int n_halvings = 0) {
    const double d = r1 - r0;
    if (std::min(r0 - d, r1 + d) < 0 && std::max(r0, r1) > 0 && n_halvings < 3) {
      const Point ab = mix({{.5, b[0]}, {.5, b[1]}}), bc = mix({{.5, b[1]}, {.5, b[2]}}),
                  cd = mix({{.5, b[2]}, {.5, b[3]}});
      const Point abc = mix({{.5, ab}, {.5, bc}}), bcd = mix({{.5, bc}, {.5, cd}}),
                  middle = mix({{.5, abc}, {.5, bcd}});
      add_bezier({b[0], ab, abc, middle}, r0, (r0 + r1) / 2, n_halvings + 1);
      add_bezier({middle, bcd, cd, b[3]}, (r0 + r1) / 2, r1, n_halvings + 1);
      return;
    }
    add(mix({{6, b[0]}, {-7, b[1]}, {2, b[2]}}), r0 - d);
    add(mix({{2, b[1]}, {-1, b[2]}}), r0);
    add(mix({{2, b[2]}, {-1, b[1]}}), r1);
    add(mix({{2, b[1]}, {-7, b[2]}, {6, b[3]}}), r1 + d);
    end();
  }
  std::string text;

 private:
  Transform to_world_;
  double scale_ = 1;
};

/// Between unit normals, along the great circle (curves.cpp: Slerp by the angle between them).
Point between(const Point& a, const Point& b, double t) {
  const double cosine = std::clamp(a[0] * b[0] + a[1] * b[1] + a[2] * b[2], -1.0, 1.0), angle = std::acos(cosine);
  if (angle < 1e-6) return a;
  const double s = std::sin(angle);
  return mix({{std::sin((1 - t) * angle) / s, a}, {std::sin(t * angle) / s, b}});
}

/// One Bezier segment as a strip, with pbrt's (u, v): along the curve, and across it.
void add_ribbon(EmbeddedMesh& mesh, const std::array<Point, 4>& b, const Point& n0, const Point& n1, double r0,
                double r1, double u0, double u1) {
  constexpr int kSteps = 32;
  const auto first = static_cast<double>(mesh.positions.size() / 3);
  for (int i = 0; i <= kSteps; ++i) {
    const double t = static_cast<double>(i) / kSteps, s = 1 - t;
    const Point p = mix({{s * s * s, b[0]}, {3 * s * s * t, b[1]}, {3 * s * t * t, b[2]}, {t * t * t, b[3]}});
    const Point d = mix({{-s * s, b[0]}, {s * s - 2 * s * t, b[1]}, {2 * s * t - t * t, b[2]}, {t * t, b[3]}});
    const Point n = between(n0, n1, t);
    Point side = {n[1] * d[2] - n[2] * d[1], n[2] * d[0] - n[0] * d[2], n[0] * d[1] - n[1] * d[0]};
    const double l = std::hypot(side[0], side[1], side[2]), r = r0 + t * (r1 - r0);
    for (double& x : side) x = l > 0 ? x / l : 0;
    for (const double sign : {-1.0, 1.0}) {
      const Point q = mix({{1, p}, {sign * r, side}});
      mesh.positions.insert(mesh.positions.end(), q.begin(), q.end());
      mesh.normals.insert(mesh.normals.end(), n.begin(), n.end());
      mesh.uvs.insert(mesh.uvs.end(), {u0 + t * (u1 - u0), 0.5 + sign / 2});
    }
    if (i == 0) continue;
    const double a = first + 2 * (i - 1);
    mesh.corners.insert(mesh.corners.end(), {a, a + 2, a + 1, a + 1, a + 2, a + 3});
  }
}

/// A curve as pbrt describes it.
struct CurveInput {
  std::vector<std::array<Point, 4>> segments;  ///< Bezier
  std::vector<Point> control;                  ///< of a B-spline, otherwise empty
  std::vector<Point> normals;                  ///< one more than segments, or empty
  double w0 = 1, w1 = 1;
  double radius(double at) const { return (w0 + (w1 - w0) * at / static_cast<double>(segments.size())) / 2; }
};

/// The Bezier segment of four points of a uniform cubic B-spline.
std::array<Point, 4> bezier_of(const std::array<Point, 4>& q) {
  return {mix({{1. / 6, q[0]}, {4. / 6, q[1]}, {1. / 6, q[2]}}), mix({{2. / 3, q[1]}, {1. / 3, q[2]}}),
          mix({{1. / 3, q[1]}, {2. / 3, q[2]}}), mix({{1. / 6, q[1]}, {4. / 6, q[2]}, {1. / 6, q[3]}})};
}

std::vector<Point> points(PbrtParameters& p, const char* name, const char* type) {
  const std::vector<double> numbers = p.get_array(name, type, 3);
  std::vector<Point> result;
  for (size_t i = 0; i < numbers.size(); i += 3) result.push_back({numbers[i], numbers[i + 1], numbers[i + 2]});
  return result;
}

/// Nullopt after an error.
std::optional<CurveInput> read_curve(PbrtParameters& p) {
  CurveInput curve;
  const std::string basis = p.get_string("basis", "bezier");
  const int64_t degree = p.get_integer("degree", 3);
  const double width = p.get_float("width", 1);
  curve.w0 = p.get_float("width0", width), curve.w1 = p.get_float("width1", width);
  const std::vector<Point> given = points(p, "P", "point3");
  curve.normals = points(p, "N", "normal3");
  p.ignore({"splitdepth"});
  const bool bezier = basis == "bezier";
  if ((!bezier && basis != "bspline") || degree < 2 || degree > 3) {
    p.error(
        fmt::format("has basis '{}' and degree {}; supported: 'bezier' and 'bspline' of degree 2 or 3", basis, degree));
    return std::nullopt;
  }
  const size_t n = given.size(), d = static_cast<size_t>(degree);
  if (n < d + 1 || (bezier && (n - 1) % d != 0) || curve.w0 < 0 || curve.w1 < 0) {
    p.error(fmt::format("has {} control points and widths {} and {}", n, curve.w0, curve.w1));
    return std::nullopt;
  }
  const size_t n_segments = bezier ? (n - 1) / d : n - d;
  for (size_t s = 0; s < n_segments; ++s) {
    const size_t first = bezier ? s * d : s;
    if (d == 3) {
      const std::array<Point, 4> q = {given[first], given[first + 1], given[first + 2], given[first + 3]};
      curve.segments.push_back(bezier ? q : bezier_of(q));
      continue;
    }
    std::array<Point, 3> q = {given[first], given[first + 1], given[first + 2]};
    if (!bezier) q = {mix({{.5, q[0]}, {.5, q[1]}}), q[1], mix({{.5, q[1]}, {.5, q[2]}})};
    curve.segments.push_back(
        {q[0], mix({{1. / 3, q[0]}, {2. / 3, q[1]}}), mix({{2. / 3, q[1]}, {1. / 3, q[2]}}), q[2]});
  }
  if (!bezier && d == 3) curve.control = given;
  if (!curve.normals.empty() && curve.normals.size() != n_segments + 1) {
    p.error(fmt::format("has {} normals for {} segments; expected one more", curve.normals.size(), n_segments));
    return std::nullopt;
  }
  return curve;
}

PbrtShape ribbon(PbrtParameters& p, const PbrtPlacement& placement, const CurveInput& curve) {
  EmbeddedMesh mesh;
  for (size_t s = 0; s < curve.segments.size(); ++s) {
    const auto u = [&](size_t i) { return static_cast<double>(i) / static_cast<double>(curve.segments.size()); };
    const auto at = static_cast<double>(s);
    add_ribbon(mesh, curve.segments[s], curve.normals[s], curve.normals[s + 1], curve.radius(at), curve.radius(at + 1),
               u(s), u(s + 1));
  }
  return pbrt_mesh_shape(p, placement, mesh);
}

}  // namespace

PbrtShape make_pbrt_curve(PbrtParameters& p, const PbrtPlacement& placement) {
  const std::string type = p.get_string("type", "flat");
  const std::optional<CurveInput> curve = read_curve(p);
  if (!curve) return {};
  if (type == "ribbon" && !curve->normals.empty()) return ribbon(p, placement, *curve);
  if (type != "flat" && type != "cylinder") {
    p.error(fmt::format("has the type '{}'{}; supported: 'flat' and 'cylinder', both as round tubes, and 'ribbon'",
                        type, type == "ribbon" ? " without normals 'N'" : ""));
    return {};
  }
  CurveText text(placement.to_world);
  for (size_t s = 0; curve->control.empty() && s < curve->segments.size(); ++s)
    text.add_bezier(curve->segments[s], curve->radius(static_cast<double>(s)),
                    curve->radius(static_cast<double>(s) + 1));
  for (size_t i = 0; i < curve->control.size(); ++i)
    text.add(curve->control[i], curve->radius(static_cast<double>(i) - 1));
  if (!curve->control.empty()) text.end();
  return {make_object("shape", "bsplinecurve", p.where(), {{std::string(kEmbeddedData), text.text}}), PbrtUv::kCurve};
}

bool join_pbrt_curves(ObjectDescription& first, const ObjectDescription& more) {
  if (first.type != "bsplinecurve" || more.type != "bsplinecurve") return false;
  std::get<std::string>(first.properties[0].value) += std::get<std::string>(more.properties[0].value);
  return true;
}

}  // namespace covary
