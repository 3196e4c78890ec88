// SPDX-License-Identifier: Apache-2.0
// A triangulation of a simple polygon has the polygon's area, by the shoelace formula, with no triangle turned over. As
// each edge of the polygon belongs to one of its triangles, they then cover each of its points once.
#include "meshes/polygon.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <string>

#include "core/error.h"
#include "core/random.h"
#include "core/transform.h"
#include "meshes/mesh_file.h"

namespace covary {
namespace {

using Triangles = std::vector<std::array<uint32_t, 3>>;

Vec3 vector_area(const std::vector<Vec3>& p, const std::array<uint32_t, 3>& t) {
  return cross(p[t[1]] - p[t[0]], p[t[2]] - p[t[0]]) * 0.5f;
}

Triangles triangles_of(const std::vector<Vec3>& points) {
  std::vector<uint32_t> corners(points.size());
  std::iota(corners.begin(), corners.end(), 0u);
  Triangles triangles;
  add_polygon(corners, points, triangles);
  return triangles;
}

Triangles fan(uint32_t n) {
  Triangles triangles;
  for (uint32_t i = 2; i < n; ++i) triangles.push_back({0, i - 1, i});
  return triangles;
}

/// Checks number, area and side of the triangles of a polygon given in the plane, seen in a few orientations, and
/// starting at each of its first eight corners.
void check(const std::vector<Vec2>& polygon) {
  double area = 0;
  for (size_t i = 0; i < polygon.size(); ++i) {
    const Vec2 a = polygon[i], b = polygon[(i + 1) % polygon.size()];
    area += 0.5 * (static_cast<double>(a.x) * b.y - static_cast<double>(a.y) * b.x);
  }
  const Transform turns[] = {Transform(), Transform::rotate({1, 2, 3}, 77), Transform::rotate({3, -1, 1}, 170),
                             Transform::translate({40, -30, 20}) * Transform::rotate({0, 1, 0}, 90)};
  for (const Transform& turn : turns)
    for (size_t start = 0; start < std::min<size_t>(polygon.size(), 8); ++start) {
      std::vector<Vec3> points;
      for (size_t i = 0; i < polygon.size(); ++i) {
        const Vec2 p = polygon[(i + start) % polygon.size()];
        points.push_back(turn.point({p.x, p.y, 0}));
      }
      const Vec3 normal = turn.vector({0, 0, area > 0 ? 1.0f : -1.0f});
      const Triangles triangles = triangles_of(points);
      EXPECT_EQ(triangles.size(), polygon.size() - 2);
      double sum = 0;
      for (const auto& t : triangles) {
        const float part = dot(vector_area(points, t), normal);
        EXPECT_GE(part, -1e-5) << "corner " << t[1] << " of " << polygon.size();
        sum += std::abs(part);
      }
      EXPECT_NEAR(sum, std::abs(area), 2e-5 * (1 + std::abs(area))) << polygon.size() << " corners from " << start;
    }
}

std::vector<Vec2> reversed(std::vector<Vec2> polygon) { return {polygon.rbegin(), polygon.rend()}; }

const std::vector<Vec2> kU = {{-1, -1}, {1, -1}, {1, 1}, {0.6f, 1}, {0.6f, -0.6f}, {-0.6f, -0.6f}, {-0.6f, 1}, {-1, 1}};

TEST(Polygon, ConvexOnesAreFans) {
  for (const uint32_t n : {3u, 4u, 5u, 12u}) {
    std::vector<Vec3> points;
    for (uint32_t i = 0; i < n; ++i) {
      const float phi = kTwoPi * static_cast<float>(i) / static_cast<float>(n);
      points.push_back({std::cos(phi), 7, std::sin(phi)});
    }
    EXPECT_EQ(triangles_of(points), fan(n));
    for (Vec3& p : points) p += Vec3{1000, 0, 300};  // coordinates rounded to 6e-5
    EXPECT_EQ(triangles_of(points), fan(n));
  }
  EXPECT_EQ(triangles_of({{0, 0, 0}, {1, 0, 0}, {1, 1, 0.3f}, {0, 1, 0}}), fan(4));          // not flat
  EXPECT_EQ(triangles_of({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {2, 1, 0}, {0, 1, 0}}), fan(5));  // corners on a line
  EXPECT_EQ(triangles_of({{0, 0, 0}, {0, 0, 0}, {2, 0, 0}, {2, 1, 0}}), fan(4));             // a corner twice
}

TEST(Polygon, ConcaveOnesAreCoveredOnce) {
  check(kU);
  check(reversed(kU));
  check({{0, 0}, {1, 0.2f}, {2, 0}, {1, 2}});                                               // a dart
  check({{0, 0}, {2, 0}, {2, 1}, {1, 1}, {1, 2}, {0, 2}});                                  // an L
  check({{0, 0}, {1, 0}, {2, 0}, {2, 1}, {2, 2}, {1, 2}, {1, 1}, {0, 1}});                  // with corners on edges
  check({{0, 0}, {2, 0}, {2, 0}, {2, 1}, {1, 1}, {1, 1}, {1, 2}, {0, 2}});                  // with corners twice
  check({{0, 0}, {2, 0}, {1, 1}, {2, 2}, {0, 2}, {1, 1}});                                  // touching itself
  check({{0, 0}, {4, 0}, {4, 4}, {0, 4}, {0, 0}, {1, 1}, {1, 3}, {3, 3}, {3, 1}, {1, 1}});  // a hole, by a cut
}

TEST(Polygon, ManyCorners) {
  std::vector<Vec2> comb = {{0, -1}, {100, -1}};
  for (int i = 100; i-- > 0;) comb.push_back({i + 1.0f, 3}), comb.push_back({i + 0.5f, 0});
  check(comb);
  std::vector<Vec2> spiral;
  for (const float width : {0.0f, 0.6f})
    for (int i = 0; i < 120; ++i) {
      const int k = width == 0 ? i : 119 - i;
      const float phi = 0.2f * static_cast<float>(k), r = 1 + phi / kTwoPi + width;
      spiral.push_back({r * std::cos(phi), r * std::sin(phi)});
    }
  check(spiral);
  for (uint64_t seed = 0; seed < 50; ++seed) {  // stars
    std::vector<Vec2> star;
    const int n = 5 + static_cast<int>(seed);
    for (int i = 0; i < n; ++i) {
      const float r = 0.1f + static_cast<float>(mix64(seed * 1000 + static_cast<uint64_t>(i)) >> 40) * 0x1p-24f;
      const float phi = kTwoPi * static_cast<float>(i) / static_cast<float>(n);
      star.push_back({r * std::cos(phi), r * std::sin(phi)});
    }
    check(star);
  }
}

/// What has no area of one sign has no right answer, but an end.
TEST(Polygon, OthersEnd) {
  EXPECT_EQ(triangles_of({{0, 0, 0}, {1, 1, 0}, {1, 0, 0}, {0, 1, 0}}).size(), 2u);             // crosses itself
  EXPECT_EQ(triangles_of({{0, 0, 0}, {2, 2, 0}, {2, 0, 0}, {0, 1, 0}, {1, 5, 0}}).size(), 3u);  // with some area
  EXPECT_EQ(triangles_of({{0, 0, 0}, {1, 0, 0}, {3, 0, 0}, {2, 0, 0}}).size(), 2u);             // a line
  EXPECT_EQ(triangles_of({{1, 1, 1}, {1, 1, 1}, {1, 1, 1}, {1, 1, 1}}).size(), 2u);             // a point
  EXPECT_EQ(triangles_of({{NAN, 0, 0}, {1, 0, 0}, {3, 0, INFINITY}, {2, 0, 0}}).size(), 2u);
  EXPECT_TRUE(triangles_of({{0, 0, 0}, {1, 0, 0}}).empty());
  Triangles triangles;
  const std::vector<Vec3> points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  add_polygon(std::array<uint32_t, 4>{0, 1, 2, 9}, points, triangles);
  EXPECT_EQ(triangles, (Triangles{{0, 1, 2}, {0, 2, 9}}));  // check_mesh() refuses it
  std::vector<Vec3> huge = {{0, -9, 0}};
  for (size_t i = 0; i < kMaxConcaveCorners; ++i) huge.push_back({static_cast<float>(i), i % 2 ? 1.0f : 0.0f, 0});
  try {
    triangles_of(huge);
    FAIL() << "accepted";
  } catch (const Error& error) {
    EXPECT_STREQ(error.what(), "a concave polygon has 65537 corners; at most 65536 are supported");
  }
}

double area_of(const MeshFile& file) {
  double sum = 0;
  for (const auto& t : file.mesh.triangles) sum += length(vector_area(file.mesh.positions, t));
  return sum;
}

std::span<const std::byte> bytes_of(const std::string& text) { return std::as_bytes(std::span(text)); }

/// 2 x 2 less 1.2 x 1.6.
constexpr double kAreaOfU = 2.08;

TEST(Polygon, OfObjFilesKeepTheirTextureCoordinates) {
  std::string text;
  for (const Vec2 p : kU)
    text += "v " + std::to_string(p.x) + " " + std::to_string(p.y) + " 0\nvt " + std::to_string(10 * p.x) + " " +
            std::to_string(10 * p.y) + "\n";
  const MeshFile file = read_obj(text + "f 1/1 2/2 3/3 4/4 5/5 6/6 7/7 8/8\n");
  EXPECT_EQ(file.mesh.triangles.size(), 6u);
  EXPECT_NEAR(area_of(file), kAreaOfU, 1e-6);
  for (size_t i = 0; i < file.mesh.positions.size(); ++i)
    EXPECT_FLOAT_EQ(file.mesh.uvs[i].x, 10 * file.mesh.positions[i].x);
}

TEST(Polygon, OfPlyFilesAreCoveredOnceInEveryLayout) {
  std::string vertices, indices = "8 0 1 2 3 4 5 6 7";
  for (const Vec2 p : kU) vertices += std::to_string(p.x) + " " + std::to_string(p.y) + " 0\n";
  const std::string head = "ply\nformat ascii 1.0\n", end = "end_header\n";
  const std::string vertex = "element vertex 8\nproperty float x\nproperty float y\nproperty float z\n";
  const std::string face = "element face 2\nproperty list uchar int vertex_indices\nproperty float id\n";
  const std::string faces = "3 0 1 2 5\n" + indices + " 7\n";
  const std::vector<std::string> wanted = {"face_id"};
  for (const bool faces_first : {false, true}) {
    const std::string text =
        faces_first ? head + face + vertex + end + faces + vertices : head + vertex + face + end + vertices + faces;
    const MeshFile file = read_ply(bytes_of(text), wanted);
    EXPECT_EQ(file.mesh.triangles.size(), 7u);
    EXPECT_NEAR(area_of(file), kAreaOfU + 2, 1e-6) << faces_first;
    EXPECT_EQ(file.mesh.attributes[0].values, (std::vector<float>{5, 7, 7, 7, 7, 7, 7}));
  }
  std::string binary = "ply\nformat binary_little_endian 1.0\n" + vertex +
                       "element face 1\nproperty list uchar int vertex_indices\n" + end;
  for (const Vec2 p : kU)
    for (const float x : {p.x, p.y, 0.0f}) binary.append(reinterpret_cast<const char*>(&x), sizeof(x));
  binary += '\x08';
  for (int i = 0; i < 8; ++i) binary.append(reinterpret_cast<const char*>(&i), sizeof(i));
  EXPECT_NEAR(area_of(read_ply(bytes_of(binary))), kAreaOfU, 1e-6);
}

}  // namespace
}  // namespace covary
