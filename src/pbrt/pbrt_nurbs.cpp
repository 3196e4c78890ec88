// SPDX-License-Identifier: Apache-2.0
// NURBS of pbrt-v3 (shapes/nurbs.cpp) as triangle meshes with their exact normals.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "pbrt/pbrt_objects.h"

namespace covary {
namespace {

constexpr size_t kSteps = 48;  // along each parameter; pbrt has 29
constexpr int64_t kMaxPoints = 1 << 16, kMaxOrder = 32;

/// B-splines of one parameter.
struct Basis {
  int64_t n = 0, order = 0;
  std::vector<double> knots;
  double from = 0, to = 1;

  double knot(int64_t i) const { return knots[static_cast<size_t>(i)]; }
  static double ratio(double a, double b) { return b != 0 ? a / b : 0; }
  /// The splines of `k` <= order at t [Piegl1997, Sec. 2.2]; n + order - k of them.
  std::vector<double> values(double t, int64_t k) const {
    const int64_t n_spans = static_cast<int64_t>(knots.size()) - 1;
    std::vector<double> result(static_cast<size_t>(n_spans), 0.0);
    int64_t span = order - 1;  // t lies in [knot(span), knot(span + 1))
    while (span + 1 < n && knot(span + 1) <= t) ++span;
    result[static_cast<size_t>(span)] = 1;
    for (int64_t of = 2; of <= k; ++of)
      for (int64_t i = 0; i + of <= n_spans; ++i) {
        const auto at = static_cast<size_t>(i);
        result[at] = ratio(t - knot(i), knot(i + of - 1) - knot(i)) * result[at] +
                     ratio(knot(i + of) - t, knot(i + of) - knot(i + 1)) * result[at + 1];
      }
    return result;
  }
  std::vector<double> slopes(double t) const {
    const std::vector<double> lower = values(t, order - 1);
    std::vector<double> result(static_cast<size_t>(n));
    for (int64_t i = 0; i < n; ++i) {
      const auto at = static_cast<size_t>(i);
      result[at] = static_cast<double>(order - 1) * (ratio(lower[at], knot(i + order - 1) - knot(i)) -
                                                     ratio(lower[at + 1], knot(i + order) - knot(i + 1)));
    }
    return result;
  }
};

std::optional<Basis> read_basis(PbrtParameters& p, char letter) {
  const auto name = [&](const char* rest) { return std::string(1, letter) + rest; };
  Basis basis;
  basis.n = p.get_integer(std::string("n") + letter, -1);
  basis.order = p.get_integer(name("order"), -1);
  basis.knots = p.get_array(name("knots"), "float", 1);
  if (basis.n < 1 || basis.n > kMaxPoints || basis.order < 2 || basis.order > kMaxOrder || basis.order > basis.n ||
      static_cast<int64_t>(basis.knots.size()) != basis.n + basis.order) {
    p.error(
        fmt::format("has {} points of order {} and {} knots along {}; expected as many points as the order or more, "
                    "and as many knots as points and order together",
                    basis.n, basis.order, basis.knots.size(), letter));
    return std::nullopt;
  }
  basis.from = p.get_float(name("0"), basis.knot(basis.order - 1)),
  basis.to = p.get_float(name("1"), basis.knot(basis.n));
  if (std::ranges::is_sorted(basis.knots) && basis.from < basis.to) return basis;
  p.error(fmt::format("has knots along {} that do not increase", letter));
  return std::nullopt;
}

/// Control points with weights, x w, y w, z w, w; empty after an error.
std::vector<std::array<double, 4>> read_points(PbrtParameters& p, size_t n) {
  const std::vector<double> weighted = p.get_array("Pw", "float", 4);
  const std::vector<double> plain = weighted.empty() ? p.get_array("P", "point3", 3) : std::vector<double>();
  std::vector<std::array<double, 4>> points;
  for (size_t i = 0; i + 3 < weighted.size(); i += 4)
    points.push_back({weighted[i], weighted[i + 1], weighted[i + 2], weighted[i + 3]});
  for (size_t i = 0; i + 2 < plain.size(); i += 3) points.push_back({plain[i], plain[i + 1], plain[i + 2], 1});
  if (points.size() == n) return points;
  p.error(fmt::format("has {} points; expected {} ('nu' times 'nv') as 'P' or 'Pw'", points.size(), n));
  return {};
}

}  // namespace

PbrtShape make_pbrt_nurbs(PbrtParameters& p, const PbrtPlacement& placement) {
  const auto u = read_basis(p, 'u'), v = read_basis(p, 'v');
  if (!u || !v) return {};
  const auto points = read_points(p, static_cast<size_t>(u->n * v->n));
  if (points.empty()) return {};
  using Four = std::array<double, 4>;
  const auto sum = [&](const std::vector<double>& of_u, const std::vector<double>& of_v) {
    Four result{};
    for (size_t j = 0; j < static_cast<size_t>(v->n); ++j)
      for (size_t i = 0; of_v[j] != 0 && i < static_cast<size_t>(u->n); ++i)
        for (size_t k = 0; k < 4; ++k) result[k] += of_u[i] * of_v[j] * points[j * static_cast<size_t>(u->n) + i][k];
    return result;
  };
  EmbeddedMesh mesh;
  for (size_t y = 0; y <= kSteps; ++y)
    for (size_t x = 0; x <= kSteps; ++x) {
      const auto at = [](const Basis& b, size_t i) {
        return b.from + (b.to - b.from) * static_cast<double>(i) / static_cast<double>(kSteps);
      };
      const double s = at(*u, x), t = at(*v, y);
      const std::vector<double> of_u = u->values(s, u->order), of_v = v->values(t, v->order);
      const Four q = sum(of_u, of_v), du = sum(u->slopes(s), of_v), dv = sum(of_u, v->slopes(t));
      double a[3], b[3];
      for (size_t k = 0; k < 3; ++k) {
        mesh.positions.push_back(q[3] != 0 ? q[k] / q[3] : 0);
        a[k] = du[k] * q[3] - q[k] * du[3], b[k] = dv[k] * q[3] - q[k] * dv[3];  // along the quotients' derivatives
      }
      const double n[3] = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
      const double length = std::hypot(n[0], n[1], n[2]);
      for (const double component : n) mesh.normals.push_back(length > 0 ? component / length : 0);
      mesh.uvs.insert(mesh.uvs.end(), {s, t});
    }
  for (size_t y = 0; y < kSteps; ++y)
    for (size_t x = 0; x < kSteps; ++x) {
      const auto a = static_cast<double>(y * (kSteps + 1) + x), b = a + static_cast<double>(kSteps + 1);
      mesh.corners.insert(mesh.corners.end(), {a, a + 1, b + 1, a, b + 1, b});
    }
  return pbrt_mesh_shape(p, placement, mesh);
}

}  // namespace covary
