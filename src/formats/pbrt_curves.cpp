// SPDX-License-Identifier: Apache-2.0
// pbrt-v4 curves as tubes around cubic B-splines; a curve of several segments becomes one spline, or one per segment.
//
// A Bezier segment b0 … b3 is the B-spline segment with control points 6 b0 - 7 b1 + 2 b2, 2 b1 - b2, 2 b2 - b1 and 2
// b1 - 7 b2 + 6 b3; a radius varying linearly from r0 to r1 has control values r0 - d, r0, r1, r1 + d with d = r1 - r0.
#include <fmt/format.h>

#include <array>
#include <cmath>

#include "formats/pbrt_objects.h"
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

}  // namespace

ObjectBuilder make_pbrt_curve(PbrtParameters& p, const PbrtPlacement& placement) {
  const std::string basis = p.get_string("basis", "bezier"), type = p.get_string("type", "flat");
  const int64_t degree = p.get_integer("degree", 3);
  const double width = p.get_float("width", 1), w0 = p.get_float("width0", width), w1 = p.get_float("width1", width);
  const std::vector<double> numbers = p.get_array("P", "point3", 3);
  p.ignore({"splitdepth", "N"});
  const bool bezier = basis == "bezier";
  if ((!bezier && basis != "bspline") || degree < 2 || degree > 3 || (!bezier && degree == 2)) {
    p.error(fmt::format("has basis '{}' and degree {}; supported: 'bezier' of degree 2 or 3 and 'bspline' of 3", basis,
                        degree));
    return nullptr;
  }
  if (type != "flat" && type != "cylinder") {
    p.error(fmt::format("has the type '{}'; supported: 'flat' and 'cylinder', both as round tubes", type));
    return nullptr;
  }
  const size_t n = numbers.size() / 3, d = static_cast<size_t>(degree);
  if (n < d + 1 || (bezier && (n - 1) % d != 0) || w0 < 0 || w1 < 0) {
    p.error(fmt::format("has {} control points and widths {} and {}", n, w0, w1));
    return nullptr;
  }
  const auto point = [&](size_t i) { return Point{numbers[3 * i], numbers[3 * i + 1], numbers[3 * i + 2]}; };
  const size_t n_segments = bezier ? (n - 1) / d : n - d;
  const auto radius = [&](double at) { return (w0 + (w1 - w0) * at / static_cast<double>(n_segments)) / 2; };
  CurveText text(placement.to_world);
  for (size_t s = 0; bezier && s < n_segments; ++s) {
    std::array<Point, 4> b{point(s * d), point(s * d + 1), point(s * d + d - 1), point(s * d + d)};
    if (d == 2)
      b[1] = mix({{1. / 3, b[0]}, {2. / 3, point(s * d + 1)}}),
      b[2] = mix({{2. / 3, point(s * d + 1)}, {1. / 3, b[3]}});
    text.add_bezier(b, radius(static_cast<double>(s)), radius(static_cast<double>(s) + 1));
  }
  for (size_t i = 0; !bezier && i < n; ++i) text.add(point(i), radius(static_cast<double>(i) - 1));
  if (!bezier) text.end();
  return make_object("shape", "bsplinecurve", p.where(), {{std::string(kEmbeddedData), text.text}});
}

bool join_pbrt_curves(ObjectDescription& first, const ObjectDescription& more) {
  if (first.type != "bsplinecurve" || more.type != "bsplinecurve") return false;
  std::get<std::string>(first.properties[0].value) += std::get<std::string>(more.properties[0].value);
  return true;
}

}  // namespace covary
