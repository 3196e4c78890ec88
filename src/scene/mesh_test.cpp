// SPDX-License-Identifier: Apache-2.0
#include "scene/mesh.h"

#include <gtest/gtest.h>

#include "core/error.h"

namespace covary {
namespace {

MeshData right_triangle() {
  MeshData data;
  data.positions = {{0, 0, 0}, {2, 0, 0}, {0, 1, 0}};
  data.triangles = {{0, 1, 2}};
  return data;
}

SurfaceHit hit_at(const TriangleMesh& mesh, float b1, float b2, bool with_derivatives) {
  SurfaceHit hit;
  hit.shape = &mesh;
  hit.primitive = 0;
  hit.barycentric = {b1, b2};
  mesh.fill({}, hit, with_derivatives);
  return hit;
}

void expect_near(const Vec3& a, const Vec3& b, float tolerance = 1e-6f) {
  EXPECT_NEAR(a.x, b.x, tolerance);
  EXPECT_NEAR(a.y, b.y, tolerance);
  EXPECT_NEAR(a.z, b.z, tolerance);
}

std::string error_of(MeshData data) {
  try {
    TriangleMesh mesh(std::move(data));
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

TEST(TriangleMesh, InterpolatesPositionNormalAndTextureCoordinates) {
  MeshData data = right_triangle();
  data.normals = {{0, 0, 1}, normalize(Vec3{1, 0, 1}), {0, 0, 1}};
  data.uvs = {{0, 0}, {1, 0}, {0, 3}};
  const TriangleMesh mesh(data);
  const SurfaceHit hit = hit_at(mesh, 0.5f, 0.25f, true);
  expect_near(hit.p, {1, 0.25f, 0});
  expect_near(hit.ng, {0, 0, 1});
  expect_near(hit.frame.n, normalize(data.normals[0] * 0.5f + data.normals[1] * 0.5f));
  EXPECT_NEAR(hit.uv.x, 0.5f, 1e-6f);
  EXPECT_NEAR(hit.uv.y, 0.75f, 1e-6f);
  // u spans two units along x, v a third of a unit along y.
  expect_near(hit.dp_du, {2, 0, 0});
  expect_near(hit.dp_dv, {0, 1.0f / 3, 0});
  EXPECT_NEAR(dot(hit.frame.s, hit.frame.n), 0, 1e-6f);
  EXPECT_GT(dot(hit.frame.s, hit.dp_du), 0);
}

TEST(TriangleMesh, WithoutTextureCoordinatesUsesBarycentricOnes) {
  const TriangleMesh mesh(right_triangle());
  const SurfaceHit hit = hit_at(mesh, 0.5f, 0.25f, true);
  EXPECT_EQ(hit.uv, (Vec2{0.5f, 0.25f}));
  expect_near(hit.dp_du, {2, 0, 0});
  expect_near(hit.dp_dv, {0, 1, 0});
}

TEST(TriangleMesh, FlippedNormalsTurnBothNormals) {
  MeshData data = right_triangle();
  data.normals = {{0, 0, 1}, {0, 0, 1}, {0, 0, 1}};
  data.flip_normals = true;
  const SurfaceHit hit = hit_at(TriangleMesh(data), 0.2f, 0.2f, false);
  expect_near(hit.ng, {0, 0, -1});
  expect_near(hit.frame.n, {0, 0, -1});
}

TEST(TriangleMesh, DropsAndCountsDegenerateTriangles) {
  MeshData data = right_triangle();
  data.triangles = {{0, 1, 1}, {0, 1, 2}, {2, 2, 2}};
  const TriangleMesh mesh(data);
  EXPECT_EQ(mesh.n_degenerate(), 2u);
  EXPECT_EQ(mesh.n_primitives(), 1u);
}

TEST(TriangleMesh, SamplesProportionallyToArea) {
  MeshData data = right_triangle();
  data.positions.push_back({-3, 0, 0});
  data.triangles.push_back({0, 2, 3});
  TriangleMesh mesh(data);
  mesh.prepare_sampling();
  EXPECT_FLOAT_EQ(mesh.area(), 2.5f);
  int left = 0;
  constexpr int kN = 1000;
  for (int i = 0; i < kN; ++i) {
    const AreaSample sample = mesh.sample_area({0.3f, 0.6f}, (static_cast<float>(i) + 0.5f) / kN);
    EXPECT_FLOAT_EQ(sample.pdf_area, 1 / 2.5f);
    expect_near(sample.n, {0, 0, 1});
    left += sample.p.x < 0;
  }
  EXPECT_EQ(left, 600);  // areas 1 and 1.5
}

/// Two triangles seen counter-clockwise from +z, the second with vertex normals towards -z, and one with normals on
/// both sides: every sample lies on the side of the normal that a hit there has, as in Mitsuba 3 (mesh.cpp) and pbrt-v4
/// (FaceForward in triangle interactions).
TEST(TriangleMesh, SamplesTheSideOfTheVertexNormals) {
  MeshData data;
  const Vec3 up = {0, 0, 1}, down = {0, 0, -1};
  for (const float x : {0.0f, 10.0f, 20.0f})
    data.positions.insert(data.positions.end(), {{x, 0, 0}, {x + 2, 0, 0}, {x, 2, 0}});
  data.normals = {up, up, up, down, down, down, up, up, down};
  data.triangles = {{0, 1, 2}, {3, 4, 5}, {6, 7, 8}};
  for (const bool flip : {false, true}) {
    data.flip_normals = flip;
    TriangleMesh mesh(data);
    mesh.prepare_sampling();
    expect_near(mesh.part_normal(0), flip ? down : up);
    expect_near(mesh.part_normal(1), flip ? up : down);
    expect_near(mesh.part_normal(2), {});  // varies
    int n_up = 0;
    for (int i = 0; i < 600; ++i) {
      const float x = (static_cast<float>(i) + 0.5f) / 600;
      for (const AreaSample& sample :
           {mesh.sample_area({x, 0.3f}, x), mesh.sample_part(static_cast<uint32_t>(i % 3), {x, 0.7f})}) {
        SurfaceHit hit;
        hit.shape = &mesh, hit.primitive = sample.primitive, hit.barycentric = sample.barycentric;
        mesh.fill({}, hit, false);
        expect_near(sample.n, dot(hit.ng, hit.frame.n) < 0 ? -hit.ng : hit.ng);
        EXPECT_GT(dot(sample.n, hit.frame.n), 0);
        n_up += sample.n.z > 0 && sample.primitive == 2;
      }
    }
    EXPECT_GT(n_up, 0);
  }
}

TEST(TriangleMesh, RejectsBrokenData) {
  MeshData data = right_triangle();
  data.triangles.push_back({0, 1, 3});
  EXPECT_EQ(error_of(data), "triangle 1 of a mesh uses vertex 3, but there are only 3");
  data = right_triangle();
  data.normals.resize(2);
  EXPECT_EQ(error_of(data), "a mesh has 3 vertices but 2 normals");
  data = right_triangle();
  data.positions[1].y = NAN;
  EXPECT_EQ(error_of(data), "vertex 1 of a mesh has a position that is not finite");
}

TEST(TriangleMesh, InterpolatesVertexColours) {
  MeshData data = right_triangle();
  data.colours = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  const TriangleMesh mesh(data);
  const SurfaceHit hit = hit_at(mesh, 0.25f, 0.5f, false);
  const Spectrum c = hit.vertex_colour();
  EXPECT_FLOAT_EQ(c.r, 0.25f);
  EXPECT_FLOAT_EQ(c.g, 0.25f);
  EXPECT_FLOAT_EQ(c.b, 0.5f);
}

}  // namespace
}  // namespace covary
