// SPDX-License-Identifier: Apache-2.0
// Bilinear patches, subdivision surfaces and height fields of pbrt as triangle meshes.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "pbrt/pbrt_objects.h"

namespace covary {
namespace {

using Point = std::array<double, 3>;

Point combine(std::initializer_list<std::pair<double, Point>> terms) {
  Point sum{};
  for (const auto& [weight, point] : terms)
    for (size_t k = 0; k < 3; ++k) sum[k] += weight * point[k];
  return sum;
}
Point cross(const Point& a, const Point& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
Point unit(const Point& v) {
  const double l = std::hypot(v[0], v[1], v[2]);
  return l > 0 ? Point{v[0] / l, v[1] / l, v[2] / l} : Point{0, 0, 1};
}

/// Adds a patch with corners p00, p10, p01, p11 as a grid of `n` × `n` cells.
class PatchGrid {
 public:
  PatchGrid(const EmbeddedMesh& given, EmbeddedMesh& mesh) : given_(given), mesh_(mesh) {}

  void add(const double* corners, int n) {
    std::copy_n(corners, 4, corners_);
    const auto first = static_cast<double>(mesh_.positions.size() / 3);
    for (int j = 0; j <= n; ++j)
      for (int i = 0; i <= n; ++i) vertex(static_cast<double>(i) / n, static_cast<double>(j) / n);
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i) {
        const double a = first + j * (n + 1) + i, b = a + n + 1;
        mesh_.corners.insert(mesh_.corners.end(), {a + 1, b, a, a + 1, b + 1, b});
      }
  }
  /// How far the corners are from a parallelogram, relative to its sides.
  double bend(const double* corners) const {
    double off = 0, size = 0;
    for (size_t k = 0; k < 3; ++k) {
      double v[4];
      for (size_t i = 0; i < 4; ++i) v[i] = given_.positions[static_cast<size_t>(corners[i]) * 3 + k];
      off = std::max(off, std::abs(v[0] + v[3] - v[1] - v[2]));
      size = std::max({size, std::abs(v[1] - v[0]), std::abs(v[2] - v[0])});
    }
    return off / std::max(size, 1e-30);
  }

 private:
  Point corner(const std::vector<double>& values, int i, size_t width = 3) const {
    Point result{};
    for (size_t k = 0; k < width; ++k) result[k] = values[static_cast<size_t>(corners_[i]) * width + k];
    return result;
  }
  Point at(const std::vector<double>& values, double u, double v, size_t width = 3) const {
    return combine({{(1 - u) * (1 - v), corner(values, 0, width)},
                    {u * (1 - v), corner(values, 1, width)},
                    {(1 - u) * v, corner(values, 2, width)},
                    {u * v, corner(values, 3, width)}});
  }
  void vertex(double u, double v) {
    const std::vector<double>& p = given_.positions;
    const Point q = at(p, u, v);
    Point n;
    if (given_.normals.empty()) {
      const Point du = combine({{v - 1, corner(p, 0)}, {1 - v, corner(p, 1)}, {-v, corner(p, 2)}, {v, corner(p, 3)}}),
                  dv = combine({{u - 1, corner(p, 0)}, {-u, corner(p, 1)}, {1 - u, corner(p, 2)}, {u, corner(p, 3)}});
      n = unit(cross(du, dv));
    } else {
      n = unit(at(given_.normals, u, v));
    }
    mesh_.positions.insert(mesh_.positions.end(), q.begin(), q.end());
    mesh_.normals.insert(mesh_.normals.end(), n.begin(), n.end());
    const Point uv = given_.uvs.empty() ? Point{u, v} : at(given_.uvs, u, v, 2);
    mesh_.uvs.push_back(uv[0]), mesh_.uvs.push_back(uv[1]);
  }

  const EmbeddedMesh& given_;
  EmbeddedMesh& mesh_;
  double corners_[4] = {};
};

/// A triangle mesh that is subdivided by Loop's rules [Loop1987], as in pbrt (util/loopsubdiv.cpp).
class Subdivision {
 public:
  Subdivision(std::vector<Point> points, std::vector<std::array<int, 3>> faces)
      : points_(std::move(points)), faces_(std::move(faces)) {
    find_rings();
  }
  /// False if an edge has more than two faces, or a vertex several fans of them.
  bool is_manifold() const { return manifold_; }

  void refine() {
    std::vector<Point> next;
    for (size_t v = 0; v < points_.size(); ++v) {
      const double n = static_cast<double>(rings_[v].size());
      next.push_back(boundary_[v] ? weighted(v, 1.0 / 8) : weighted(v, beta(n)));
    }
    std::map<std::pair<int, int>, int> middles;
    const auto middle = [&](int a, int b) {
      const auto [place, is_new] = middles.emplace(std::minmax(a, b), static_cast<int>(next.size()));
      if (is_new) next.push_back(edge_point(a, b));
      return place->second;
    };
    std::vector<std::array<int, 3>> faces;
    for (const auto& [a, b, c] : faces_) {
      const int ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      for (const std::array<int, 3>& face : {std::array{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}})
        faces.push_back(face);
    }
    points_ = std::move(next), faces_ = std::move(faces);
    find_rings();
  }
  /// Moves all vertices to the limit surface.
  void to_limit() {
    std::vector<Point> limit;
    for (size_t v = 0; v < points_.size(); ++v) {
      const double n = static_cast<double>(rings_[v].size());
      limit.push_back(boundary_[v] ? weighted(v, 1.0 / 5) : weighted(v, 1 / (n + 3 / (8 * beta(n)))));
    }
    points_ = std::move(limit);
  }
  /// pbrt's point to the other side than the order of the corners.
  Point normal(size_t v) const {
    const std::vector<int>& ring = rings_[v];
    const auto n = ring.size();
    const auto at = [&](size_t i) { return points_[static_cast<size_t>(ring[i])]; };
    Point s{}, t{};
    if (!boundary_[v]) {
      for (size_t j = 0; j < n; ++j) {
        const double angle = 2 * M_PI * static_cast<double>(j) / static_cast<double>(n);
        s = combine({{1, s}, {std::cos(angle), at(j)}}), t = combine({{1, t}, {-std::sin(angle), at(j)}});
      }
      return cross(s, t);
    }
    s = combine({{1, at(n - 1)}, {-1, at(0)}});
    if (n == 2) {
      t = combine({{1, at(0)}, {1, at(1)}, {-2, points_[v]}});
    } else if (n == 3) {
      t = combine({{1, at(1)}, {-1, points_[v]}});
    } else if (n == 4) {
      t = combine({{-1, at(0)}, {2, at(1)}, {2, at(2)}, {-1, at(3)}, {-2, points_[v]}});
    } else {
      const double theta = M_PI / static_cast<double>(n - 1);
      t = combine({{-std::sin(theta), at(0)}, {-std::sin(theta), at(n - 1)}});
      for (size_t k = 1; k + 1 < n; ++k)
        t = combine({{1, t}, {(2 - 2 * std::cos(theta)) * std::sin(static_cast<double>(k) * theta), at(k)}});
    }
    return cross(s, t);
  }
  const std::vector<Point>& points() const { return points_; }
  const std::vector<std::array<int, 3>>& faces() const { return faces_; }

 private:
  static double beta(double n) { return n == 3 ? 3.0 / 16 : 3 / (8 * n); }
  /// A vertex and its neighbours, those along the boundary alone if it lies there.
  Point weighted(size_t v, double weight) const {
    const std::vector<int>& ring = rings_[v];
    if (ring.empty()) return points_[v];
    const auto at = [&](int i) { return points_[static_cast<size_t>(i)]; };
    if (boundary_[v])
      return combine({{1 - 2 * weight, points_[v]}, {weight, at(ring.front())}, {weight, at(ring.back())}});
    Point sum = combine({{1 - static_cast<double>(ring.size()) * weight, points_[v]}});
    for (const int other : ring) sum = combine({{1, sum}, {weight, at(other)}});
    return sum;
  }
  Point edge_point(int a, int b) const {
    const auto at = [&](int i) { return points_[static_cast<size_t>(i)]; };
    const auto left = opposite_.find({a, b}), right = opposite_.find({b, a});
    if (left == opposite_.end() || right == opposite_.end()) return combine({{0.5, at(a)}, {0.5, at(b)}});
    return combine({{3.0 / 8, at(a)}, {3.0 / 8, at(b)}, {1.0 / 8, at(left->second)}, {1.0 / 8, at(right->second)}});
  }
  /// The neighbours of each vertex, counter-clockwise.
  void find_rings() {
    opposite_.clear();
    for (const auto& [a, b, c] : faces_)
      for (const std::array<int, 3>& f : {std::array{a, b, c}, {b, c, a}, {c, a, b}})
        manifold_ &= opposite_.emplace(std::pair(f[0], f[1]), f[2]).second;
    rings_.assign(points_.size(), {}), boundary_.assign(points_.size(), false);
    std::vector<int> n_faces(points_.size());
    for (const auto& face : faces_)
      for (const int v : face) ++n_faces[static_cast<size_t>(v)];
    for (const auto& face : faces_)
      for (size_t k = 0; k < 3; ++k) {
        const int v = face[k];
        std::vector<int>& ring = rings_[static_cast<size_t>(v)];
        if (!ring.empty() || !manifold_) continue;
        // Back to the first neighbour, if there is one; then forwards.
        int first = face[(k + 1) % 3];
        const int begin = first;
        for (auto before = opposite_.find({first, v}); before != opposite_.end(); before = opposite_.find({first, v})) {
          first = before->second;
          if (first == begin) break;
        }
        ring.push_back(first);
        for (auto next = opposite_.find({v, first}); next != opposite_.end(); next = opposite_.find({v, ring.back()})) {
          if (next->second == first) break;
          ring.push_back(next->second);
        }
        boundary_[static_cast<size_t>(v)] = !opposite_.contains({v, ring.back()});
        const int faces_of_ring = static_cast<int>(ring.size()) - (boundary_[static_cast<size_t>(v)] ? 1 : 0);
        manifold_ &= faces_of_ring == n_faces[static_cast<size_t>(v)];
      }
  }

  std::vector<Point> points_;
  std::vector<std::array<int, 3>> faces_;
  std::map<std::pair<int, int>, int> opposite_;  // the third corner of the face on the left of an edge
  std::vector<std::vector<int>> rings_;
  std::vector<bool> boundary_;
  bool manifold_ = true;
};

}  // namespace

/// Parallelograms are two triangles each; bent patches become grids, finer if there are few of them.
PbrtShape make_pbrt_bilinear_mesh(PbrtParameters& p, const PbrtPlacement& placement) {
  const std::optional<EmbeddedMesh> given = read_pbrt_vertices(p);
  p.ignore({"faceIndices"});
  if (!given) return {};
  const std::vector<double> indices = read_pbrt_indices(p, given->positions.size() / 3, 4);
  if (indices.empty()) return {};
  constexpr double kFlat = 1e-4;
  EmbeddedMesh mesh;
  PatchGrid grid(*given, mesh);
  size_t n_bent = 0;
  for (size_t patch = 0; patch < indices.size(); patch += 4) n_bent += grid.bend(&indices[patch]) > kFlat;
  const int cells = n_bent <= 64 ? 32 : n_bent <= 1024 ? 16 : n_bent <= 65536 ? 4 : 2;
  for (size_t patch = 0; patch < indices.size(); patch += 4)
    grid.add(&indices[patch], grid.bend(&indices[patch]) > kFlat ? cells : 1);
  if (n_bent == 0 && given->normals.empty()) mesh.normals.clear();
  return pbrt_mesh_shape(p, placement, mesh);
}

PbrtShape make_pbrt_subdivision(PbrtParameters& p, const PbrtPlacement& placement) {
  const std::optional<EmbeddedMesh> given = read_pbrt_vertices(p);
  const int64_t levels = p.get_integer(p.has("nlevels") ? "nlevels" : "levels", 3);
  p.ignore({"scheme"});
  if (!given) return {};
  const std::vector<double> indices = read_pbrt_indices(p, given->positions.size() / 3, 3);
  if (indices.empty()) return {};
  constexpr double kMaxFaces = 1 << 24;
  if (levels < 0 || static_cast<double>(indices.size()) / 3 * std::pow(4.0, static_cast<double>(levels)) > kMaxFaces) {
    p.error(fmt::format("has {} levels for {} faces; at most {:.0f} faces are made", levels, indices.size() / 3,
                        kMaxFaces));
    return {};
  }
  std::vector<Point> points;
  for (size_t i = 0; i < given->positions.size(); i += 3)
    points.push_back({given->positions[i], given->positions[i + 1], given->positions[i + 2]});
  std::vector<std::array<int, 3>> faces;
  for (size_t i = 0; i < indices.size(); i += 3)
    faces.push_back({static_cast<int>(indices[i]), static_cast<int>(indices[i + 1]), static_cast<int>(indices[i + 2])});
  Subdivision surface(std::move(points), std::move(faces));
  if (!surface.is_manifold()) {
    p.error("is not a manifold: an edge has more than two faces, or a vertex several fans of them");
    return {};
  }
  for (int64_t level = 0; level < levels; ++level) surface.refine();
  surface.to_limit();
  EmbeddedMesh mesh;
  for (size_t v = 0; v < surface.points().size(); ++v) {
    const Point n = unit(surface.normal(v));
    mesh.positions.insert(mesh.positions.end(), surface.points()[v].begin(), surface.points()[v].end());
    mesh.normals.insert(mesh.normals.end(), n.begin(), n.end());
  }
  for (const std::array<int, 3>& face : surface.faces())
    for (const int corner : face) mesh.corners.push_back(corner);
  return pbrt_mesh_shape(p, placement, mesh);
}

/// Version 3: heights Pz over the unit square.
PbrtShape make_pbrt_height_field(PbrtParameters& p, const PbrtPlacement& placement) {
  const int64_t nu = p.get_integer("nu", -1), nv = p.get_integer("nv", -1);
  const std::vector<double> heights = p.get_array("Pz", "float", 1);
  if (nu < 2 || nv < 2 || nu > 65536 || nv > 65536 || static_cast<int64_t>(heights.size()) != nu * nv) {
    p.error(fmt::format("has {} heights for {} x {} points", heights.size(), nu, nv));
    return {};
  }
  EmbeddedMesh mesh;
  for (int64_t y = 0; y < nv; ++y)
    for (int64_t x = 0; x < nu; ++x) {
      const double u = static_cast<double>(x) / static_cast<double>(nu - 1),
                   v = static_cast<double>(y) / static_cast<double>(nv - 1);
      mesh.positions.insert(mesh.positions.end(), {u, v, heights[static_cast<size_t>(y * nu + x)]});
      mesh.uvs.insert(mesh.uvs.end(), {u, v});
    }
  for (int64_t y = 0; y + 1 < nv; ++y)
    for (int64_t x = 0; x + 1 < nu; ++x) {
      const auto a = static_cast<double>(y * nu + x), b = a + static_cast<double>(nu);
      mesh.corners.insert(mesh.corners.end(), {a, a + 1, b + 1, a, b + 1, b});
    }
  return pbrt_mesh_shape(p, placement, mesh);
}

}  // namespace covary
