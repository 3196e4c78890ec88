// SPDX-License-Identifier: Apache-2.0
// Media of pbrt-v4 files. Expected values come from pbrt's definitions, named with each test.
#include <gtest/gtest.h>

#include <cmath>

#include "support/pbrt_scenes.h"

namespace covary::pbrt_media_test {
namespace {

using test_support::contains;

class PbrtMedia : public test_support::PbrtScenes {};

/// media.h: GridMedium; util/containers.h: SampledGrid is centred like texels, 0 outside.
TEST_F(PbrtMedia, GridsScaleTheirCoefficients) {
  const LoadedScene scene = world(R"(
Translate 10 0 0
MakeNamedMedium "smoke" "string type" "uniformgrid" "integer nx" 2 "float density" [ 1 3 ]
  "point3 p0" [ 0 0 0 ] "point3 p1" [ 2 1 1 ] "rgb sigma_a" [ 1 2 3 ] "rgb sigma_s" [ 3 2 1 ] "float scale" 0.5
  "rgb Le" [ 2 4 6 ] "float Lescale" [ 1 10 ]
MediumInterface "smoke" ""
Material "interface"
Shape "sphere" "float radius" 4
)");
  SurfaceHit hit;
  ASSERT_TRUE(scene.scene->intersect({{10, 0, 100}, {0, 0, -1}}, hit));
  const Medium* smoke = hit.shape->medium_towards(hit.ng, {0, 0, -1});
  ASSERT_TRUE(smoke);
  const auto at = [&](float x, float y = 0.5f) { return smoke->at({10 + x, y, 0.5f}); };
  EXPECT_NEAR(at(0.5f).extinction.g, 0.5f * 4 * 1, 1e-5f);
  EXPECT_NEAR(at(1.5f).extinction.g, 0.5f * 4 * 3, 1e-5f);
  EXPECT_NEAR(at(1).extinction.r, 0.5f * 4 * 2, 1e-5f);
  EXPECT_NEAR(at(1.5f).scattering.b, 0.5f * 1 * 3, 1e-5f);
  EXPECT_NEAR(at(0).extinction.g, 0.5f * 4 * 0.5f, 1e-5f);  // halfway to the 0 outside
  EXPECT_EQ(at(-0.1f).extinction.g, 0);
  EXPECT_EQ(at(0.5f, 1.1f).extinction.g, 0);
  const Spectrum glow = smoke->emission({11.5f, 0.5f, 0.5f}, at(1.5f));  // Le Lescale sigma_a
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(glow[c], 20 * (c + 1) * 0.5f * (c + 1) * 3, 1e-2f);
  EXPECT_EQ(warnings(scene).find("glows"), std::string::npos);
}

TEST_F(PbrtMedia, MediaHaveNamesAndColoursInEachCell) {
  const LoadedScene scene = world(R"(
MakeNamedMedium "milk" "string type" "homogeneous" "string preset" "Wholemilk" "float scale" 2
MakeNamedMedium "grid" "string type" "rgbgrid" "integer nx" 1 "integer nz" 2 "rgb sigma_a" [ 1 1 1  0 0 2 ]
  "rgb sigma_s" [ 1 3 0  2 2 2 ]
MediumInterface "milk" "grid"
Material "interface"
Shape "sphere" "float radius" 4
)");
  SurfaceHit hit;
  ASSERT_TRUE(scene.scene->intersect({{0, 0, 100}, {0, 0, -1}}, hit));
  // [Jensen2001], Fig. 5: whole milk.
  const auto milk = hit.shape->medium_towards(hit.ng, {0, 0, -1})->at({});
  EXPECT_NEAR(milk.scattering.r, 2 * 2.55f, 1e-4f);
  EXPECT_NEAR(milk.extinction.b, 2 * (3.77f + 0.014f), 1e-4f);
  const auto low = hit.shape->medium_towards(hit.ng, {0, 0, 1})->at({0.5f, 0.5f, 0.25f});
  EXPECT_NEAR(low.extinction.g, 4, 1e-5f);
  EXPECT_NEAR(low.scattering.g, 3, 1e-5f);
}

TEST_F(PbrtMedia, ObjectsWithMediaAreCopied) {
  const LoadedScene scene = world(R"(
MakeNamedMedium "milk" "string type" "homogeneous"
ObjectBegin "drop"
MediumInterface "milk" ""
Material "dielectric"
Translate 0 0 1
Shape "sphere"
ObjectEnd
Translate 5 0 0
ObjectInstance "drop"
Scale 2 2 2
ObjectInstance "drop"
)");
  EXPECT_EQ(scene.scene->n_shapes(), 2u);
  EXPECT_NEAR(height(scene, 5, 0), 4, 1e-4f);
  SurfaceHit hit;
  ASSERT_TRUE(scene.scene->intersect({{5, 0, 100}, {0, 0, -1}}, hit));
  EXPECT_TRUE(hit.shape->medium_towards(hit.ng, {0, 0, -1}));
}

}  // namespace
}  // namespace covary::pbrt_media_test
