// SPDX-License-Identifier: Apache-2.0
// Curve files, attributes of PLY files, and the shapes made from them.
#include "io/shapes.h"

#include <gtest/gtest.h>

#include <fstream>

#include "io/load_scene.h"
#include "meshes/mesh_file.h"
#include "support/files.h"

namespace covary {
namespace {

using test_support::contains;
using test_support::message_of;

void write(const std::string& path, const std::string& text) { std::ofstream(path, std::ios::binary) << text; }

TEST(CurveFile, BlankLinesBeginCurves) {
  const auto curves = read_curves("0 0 0 1\r\n1 0 0 1\n2 0 0 1\n\n \t\n0 1 0 2\n1 1 0 2", CurveKind::kLinear,
                                  Transform::scale({2, 1, 1}));
  EXPECT_EQ(curves->segments(), (std::vector<uint32_t>{0, 1, 3}));
  EXPECT_EQ(curves->points()[2], (CurvePoint{4, 0, 0, 1}));
  EXPECT_EQ(curves->bounds().upper.y, 3);
  EXPECT_FALSE(curves->can_emit());
}

TEST(CurveFile, NamesLinesThatAreWrong) {
  const auto message = [](const char* text) {
    return message_of([&] { read_curves(text, CurveKind::kBspline, Transform()); });
  };
  EXPECT_TRUE(contains(message("0 0 0 1\n1 0 x 1\n"), "line 2: "));
  EXPECT_TRUE(contains(message("0 0 0 1\n1 0 0\n"), "line 2: "));
  EXPECT_TRUE(contains(message("0 0 0 -1\n"), "line 1: the radius is -1"));
  EXPECT_TRUE(contains(message("0 0 0 1\n1 0 0 1\n\n"), "the curve before it has 2 control points; at least 4"));
  EXPECT_TRUE(contains(message("\n\n"), "there is no curve"));
}

/// A straight curve along x of radius 0.5, seen from above: position, normal and parameters of the tube.
TEST(Curves, AreRoundTubes) {
  const test_support::TemporaryFolder folder;
  const auto hit_of = [&](const std::string& type, const std::string& points, SurfaceHit& hit, const Vec3& o) {
    write(folder.file("c.txt"), points);
    write(folder.file("s.xml"), "<scene version=\"3.0.0\"><sensor type=\"perspective\"/><shape type=\"" + type +
                                    "\"><string name=\"filename\" value=\"c.txt\"/></shape></scene>");
    const LoadedScene scene = load_scene(folder.file("s.xml"));
    return scene.scene->intersect({o, {0, 0, -1}}, hit);
  };
  SurfaceHit hit;
  ASSERT_TRUE(hit_of("linearcurve", "0 0 0 0.5\n2 0 0 0.5\n4 0 0 0.5\n", hit, {3, 0.3f, 5}));
  EXPECT_NEAR(hit.p.z, 0.4f, 1e-4f);
  EXPECT_NEAR(hit.ng.y, 0.6f, 1e-3f);
  EXPECT_NEAR(hit.uv.y, 0.75f, 1e-3f);
  ASSERT_TRUE(hit_of("bsplinecurve", "0 0 0 0.5\n1 0 0 0.5\n2 0 0 0.5\n3 0 0 0.5\n", hit, {1.25f, -0.3f, 5}));
  EXPECT_NEAR(hit.p.z, 0.4f, 1e-3f);
  EXPECT_NEAR(hit.ng.y, -0.6f, 1e-2f);
  EXPECT_NEAR(hit.uv.y, 0.25f, 1e-2f);
  EXPECT_FALSE(hit_of("bsplinecurve", "0 0 0 0.5\n1 0 0 0.5\n2 0 0 0.5\n3 0 0 0.5\n", hit, {0.5f, 0, 5}));
}

/// A ray into the open end of a tube along z: the inside is not hit.
TEST(Curves, AreSeenFromOutsideAlone) {
  const test_support::TemporaryFolder folder;
  write(folder.file("c.txt"), "0 0 0 0.5\n0 0 1 0.5\n0 0 2 0.5\n0 0 3 0.5\n");
  write(folder.file("s.xml"),
        "<scene version=\"3.0.0\"><sensor type=\"perspective\"/><shape type=\"bsplinecurve\">"
        "<string name=\"filename\" value=\"c.txt\"/></shape></scene>");
  const LoadedScene scene = load_scene(folder.file("s.xml"));
  SurfaceHit hit;
  EXPECT_FALSE(scene.scene->intersect({{0.2f, 0, 5}, normalize(Vec3{0.1f, 0, -1})}, hit));
  EXPECT_FALSE(scene.scene->occluded({{0.2f, 0, 5}, normalize(Vec3{0.1f, 0, -1}), 20}));
  EXPECT_TRUE(scene.scene->occluded({{3, 0, 1.5f}, {-1, 0, 0}, 20}));
}

TEST(Curves, CannotEmit) {
  const test_support::TemporaryFolder folder;
  write(folder.file("c.txt"), "0 0 0 1\n1 0 0 1\n");
  write(folder.file("s.xml"),
        "<scene version=\"3.0.0\"><sensor type=\"perspective\"/><shape type=\"linearcurve\">"
        "<string name=\"filename\" value=\"c.txt\"/><emitter type=\"area\"/></shape></scene>");
  EXPECT_TRUE(
      contains(message_of([&] { load_scene(folder.file("s.xml")); }), "shape 'linearcurve': cannot emit light"));
}

MeshFile ply(const std::string& text, const std::vector<std::string>& wanted) {
  return read_ply(std::as_bytes(std::span(text.data(), text.size())), wanted);
}

/// A square as one polygon, and a triangle.
const std::string kAttributes =
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
    "property float heat_x\nproperty float heat_y\nproperty float heat_z\nproperty uchar weight\n"
    "element face 2\nproperty uchar color_r\nproperty list uchar int vertex_indices\nproperty uchar color_g\n"
    "property uchar color_b\nend_header\n"
    "0 0 0 1 2 3 10\n1 0 0 4 5 6 20\n1 1 0 7 8 9 30\n0 1 0 1 1 1 40\n255 4 0 1 2 3 0 255\n0 3 0 1 2 255 0\n";

TEST(PlyAttributes, AreReadWhereTheyAreWanted) {
  const MeshFile file = ply(kAttributes, {"vertex_heat", "vertex_weight", "face_color", "face_other"});
  ASSERT_EQ(file.mesh.attributes.size(), 3u);
  const MeshAttribute &heat = file.mesh.attributes[0], &weight = file.mesh.attributes[1],
                      &colour = file.mesh.attributes[2];
  EXPECT_EQ(heat.name, "vertex_heat");
  EXPECT_EQ(heat.values, (std::vector<float>{1, 2, 3, 4, 5, 6, 7, 8, 9, 1, 1, 1}));
  EXPECT_EQ(weight.values, (std::vector<float>{10, 20, 30, 40}));
  EXPECT_TRUE(colour.per_face);
  EXPECT_EQ(colour.values, (std::vector<float>{1, 0, 1, 1, 0, 1, 0, 1, 0}));
  EXPECT_TRUE(ply(kAttributes, {}).mesh.attributes.empty());
}

}  // namespace
}  // namespace covary
