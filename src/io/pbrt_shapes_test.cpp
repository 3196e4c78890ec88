// SPDX-License-Identifier: Apache-2.0
// Shapes of pbrt-v4 files. Expected values come from pbrt's formulas, named with each test.
#include <gtest/gtest.h>

#include <cmath>

#include "support/pbrt_scenes.h"

namespace covary::pbrt_shapes_test {
namespace {

using test_support::contains;

class PbrtShapes : public test_support::PbrtScenes {};

/// shapes.h: Sphere, Disk, Cylinder. Meshes of 256 steps around are within 1 - cos(pi / 256) of the surface.
TEST_F(PbrtShapes, QuadricsMayBeStretchedAndCut) {
  constexpr float kNear = 3e-4f;
  const LoadedScene ellipsoid = world("Scale 1 2 3\nShape \"sphere\"\n");
  EXPECT_NEAR(height(ellipsoid, 0, 0), 3, 3 * kNear);
  EXPECT_NEAR(height(ellipsoid, 0.6f, 0), 3 * 0.8f, 3 * kNear);
  EXPECT_NEAR(height(ellipsoid, 0, 1.2f), 3 * 0.8f, 3 * kNear);
  EXPECT_EQ(height(ellipsoid, 1.01f, 0), -1000);

  // The band between z = -0.5 and 0, a quarter around: only x, y > 0.
  const LoadedScene band = world("Shape \"sphere\" \"float zmin\" -0.5 \"float zmax\" 0 \"float phimax\" 90\n");
  EXPECT_NEAR(height(band, 0.63639610f, 0.63639610f), -std::sqrt(1 - 0.81f), 2 * kNear);
  EXPECT_EQ(height(band, 0.5f, 0.5f), -1000);  // nearer the pole
  EXPECT_EQ(height(band, -0.9f, 0), -1000);

  const LoadedScene ring = world("Shape \"disk\" \"float innerradius\" 0.5 \"float height\" 2 \"float phimax\" 180\n");
  EXPECT_NEAR(height(ring, 0, 0.75f), 2, 1e-6f);
  EXPECT_EQ(height(ring, 0, 0.4f), -1000);
  EXPECT_EQ(height(ring, 0, -0.75f), -1000);

  const LoadedScene tube = world("Rotate 90 0 1 0\nScale 1 3 1\nShape \"cylinder\" \"float phimax\" 359.9\n");
  EXPECT_NEAR(height(tube, 0.5f, 1.8f), 0.8f, kNear);
}

/// Normals, sides and texture coordinates of the parts.
TEST_F(PbrtShapes, PartsHavePbrtsCoordinates) {
  const LoadedScene scene = world(R"(
Texture "uv" "spectrum" "bilerp" "rgb v00" [ 0 0 0 ] "rgb v10" [ 1 0 0 ] "rgb v01" [ 0 1 0 ] "rgb v11" [ 1 1 0 ]
Material "diffuse" "texture reflectance" "uv"
Shape "sphere" "float zmin" 0 "float phimax" 180
)");
  // v = (theta - theta_zmin) / (theta_zmax - theta_zmin), theta_zmin = 90 degrees at z = 0; u = phi / phimax.
  const float x = 0.3f, y = 0.5f, z = std::sqrt(1 - x * x - y * y);
  const Spectrum uv = brdf(scene, x, y, {x, y, z}) * kPi;
  EXPECT_NEAR(uv.r, std::atan2(y, x) / kPi, 2e-3f);
  EXPECT_NEAR(uv.g, 1 - std::acos(z) / (kPi / 2), 2e-3f);
  SurfaceHit hit;
  ASSERT_TRUE(scene.scene->intersect({{x, y, 10}, {0, 0, -1}}, hit));
  EXPECT_NEAR(dot(hit.frame.n, {x, y, z}), 1, 1e-4f);
  EXPECT_GT(dot(hit.ng, hit.frame.n), 0.99f);
  ASSERT_TRUE(
      world("ReverseOrientation\nShape \"sphere\" \"float zmin\" 0\n").scene->intersect({{x, y, 10}, {0, 0, -1}}, hit));
}

/// shapes.h: BilinearPatch; p = lerp(v, lerp(u, p00, p10), lerp(u, p01, p11)), here z = x y.
TEST_F(PbrtShapes, BentPatchesAreSaddles) {
  const LoadedScene scene = world("Shape \"bilinearmesh\" \"point3 P\" [ 0 0 0  1 0 0  0 1 0  1 1 1 ]\n");
  for (const Vec2 at : {Vec2{0.3f, 0.4f}, Vec2{0.9f, 0.8f}, Vec2{0.51f, 0.13f}}) {
    SurfaceHit hit;
    ASSERT_TRUE(scene.scene->intersect({{at.x, at.y, 5}, {0, 0, -1}}, hit));
    EXPECT_NEAR(hit.p.z, at.x * at.y, 5e-4f);
    EXPECT_NEAR(dot(hit.frame.n, normalize(Vec3{-at.y, -at.x, 1})), 1, 1e-4f);
  }
}

/// util/loopsubdiv.cpp, for the octahedron: beta = 3 / 32, the limit of a corner is (1 - 4 gamma) of it with gamma =
/// 1 / (4 + 3 / (8 beta)) = 1 / 8, however often the mesh is divided before.
TEST_F(PbrtShapes, SubdivisionGoesToItsLimit) {
  for (const int levels : {0, 1, 3}) {
    const LoadedScene scene = world("Shape \"loopsubdiv\" \"integer levels\" " + std::to_string(levels) + R"(
  "point3 P" [ 1 0 0  -1 0 0  0 1 0  0 -1 0  0 0 1  0 0 -1 ]
  "integer indices" [ 0 2 4  2 1 4  1 3 4  3 0 4  2 0 5  1 2 5  3 1 5  0 3 5 ])");
    EXPECT_NEAR(height(scene, 1e-6f, 0), 0.5f, 1e-5f) << levels;
    EXPECT_EQ(scene.scene->n_shapes(), 1u);
  }
  // A flat square stays flat; its boundary is a curve of its own: the limit of a corner is 3 / 5 of it + 1 / 5 of each
  // neighbour, of (1, 1) thus (0.6, 0.6).
  const LoadedScene square = world(R"(
Shape "loopsubdiv" "integer levels" 0 "point3 P" [ 1 1 2  -1 1 2  -1 -1 2  1 -1 2 ]
  "integer indices" [ 0 1 2  0 2 3 ])");
  EXPECT_NEAR(height(square, 0.59f, 0.59f), 2, 1e-6f);
  EXPECT_EQ(height(square, 0.61f, 0.61f), -1000);
  EXPECT_TRUE(
      contains(errors("WorldBegin\nShape \"loopsubdiv\" \"point3 P\" [ 0 0 0 1 0 0 0 1 0 0 0 1 0 1 1 ] \"integer "
                      "indices\" [ 0 1 2 0 1 3 0 1 4 ]"),
               "is not a manifold"));
}

/// curves.cpp: a ribbon is as wide as its width, across its tangent and the normal at each of its ends.
TEST_F(PbrtShapes, RibbonsLieAcrossTheirNormals) {
  const LoadedScene scene = world(R"(
Shape "curve" "string type" "ribbon" "point3 P" [ 0 0 1  1 0 1  2 0 1  3 0 1 ] "normal N" [ 0 0 1  0 0 1 ]
  "float width0" 0.4 "float width1" 0.8)");
  for (const float x : {0.5f, 1.5f, 2.5f}) {
    const float half = (0.4f + 0.4f * x / 3) / 2;
    EXPECT_NEAR(height(scene, x, 0.98f * half), 1, 1e-5f);
    EXPECT_EQ(height(scene, x, 1.02f * half), -1000);
  }
  EXPECT_TRUE(contains(
      errors("WorldBegin\nShape \"curve\" \"string type\" \"ribbon\" \"point3 P\" [ 0 0 1  1 0 1  2 0 1  3 0 1 ]"),
      "has the type 'ribbon' without normals"));
}

}  // namespace
}  // namespace covary::pbrt_shapes_test
