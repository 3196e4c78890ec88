// SPDX-License-Identifier: Apache-2.0
// Media in scene files: their assignment to shapes and sensors, and errors.
#include "io/media.h"

#include <gtest/gtest.h>

#include "io/load_scene.h"
#include "support/files.h"

namespace covary {
namespace {

using test_support::contains;
using test_support::message_of;

const std::string kSensor = "<sensor type=\"perspective\"/>";

LoadedScene load(const std::string& body) {
  return load_scene_text("<scene version=\"3.0.0\">\n" + body + "\n</scene>", "scene.xml");
}
std::string errors(const std::string& body) {
  return message_of([&] { load(body); }, ErrorCode::kInput);
}

TEST(MediaInFiles, ShapesHaveThemOnTheirSides) {
  const LoadedScene loaded = load(kSensor + R"(
<medium type="homogeneous" id="fog"><float name="sigma_t" value="3"/></medium>
<shape type="sphere"><bsdf type="null"/><ref name="exterior" id="fog"/>
<medium name="interior" type="heterogeneous"><phase type="hg"/></medium></shape>)");
  const Scene& scene = *loaded.scene;
  EXPECT_EQ(scene.first_medium(), "scene.xml:4:41: medium 'homogeneous'");
  EXPECT_EQ(scene.camera_medium(), nullptr);
  SurfaceHit hit;
  ASSERT_TRUE(scene.intersect({{0, 0, -3}, {0, 0, 1}}, hit));
  ASSERT_TRUE(hit.shape->bounds_medium());
  EXPECT_EQ(hit.shape->medium_towards(hit.ng, {0, 0, -1})->majorant(), Spectrum(3));
  EXPECT_FALSE(hit.shape->medium_towards(hit.ng, {0, 0, 1})->homogeneous());
  EXPECT_TRUE(loaded.warnings.empty());
}

TEST(MediaInFiles, TheCameraHasOne) {
  const LoadedScene loaded = load("<sensor type=\"perspective\"><medium type=\"homogeneous\"/></sensor>");
  ASSERT_NE(loaded.scene->camera_medium(), nullptr);
  EXPECT_TRUE(contains(loaded.scene->first_medium(), "scene.xml:2:"));
}

TEST(MediaInFiles, OneThatNothingUsesIsRead) {
  EXPECT_FALSE(load(kSensor + "<medium type=\"homogeneous\" id=\"fog\"/>").scene->has_media());
  EXPECT_TRUE(contains(errors(kSensor + "\n<medium type=\"homogenous\" id=\"fog\"/>"),
                       "scene.xml:3:1: unknown medium 'homogenous'; did you mean 'homogeneous' or"));
}

TEST(MediaInFiles, MistakesAreNamed) {
  EXPECT_TRUE(contains(errors(kSensor + R"(
<medium type="homogeneous"><phase type="hg"/><phase type="isotropic"/></medium>)"),
                       "medium 'homogeneous': has 2 phases; expected one"));
  EXPECT_TRUE(contains(errors(kSensor + R"(
<medium type="homogeneous"><volume name="sigma_t" type="gridvolume"/></medium>)"),
                       "volume 'gridvolume': the string 'filename' is missing"));
  EXPECT_TRUE(contains(errors(kSensor + R"(
<medium type="homogeneous"><texture name="albedo" type="checkerboard"/></medium>)"),
                       "parameter 'albedo' of medium 'homogeneous' must be a volume, not a texture"));
  EXPECT_TRUE(contains(errors(kSensor + R"(
<shape type="sphere"><bsdf type="null" name="interior"/></shape>)"),
                       "parameter 'interior' of shape 'sphere' must be a medium, not a bsdf"));
  EXPECT_TRUE(contains(errors(kSensor + "\n<shape type=\"sphere\"><medium type=\"homogeneous\"/></shape>"),
                       "shape 'sphere' cannot hold medium 'homogeneous'"));
}

TEST(MediaInFiles, ShapesOfGroupsHaveNone) {
  EXPECT_TRUE(contains(errors(kSensor + R"(
<shape type="shapegroup" id="g"><shape type="sphere"><medium name="interior" type="homogeneous"/></shape></shape>
<shape type="instance"><ref id="g"/></shape>)"),
                       "shape 'sphere': has a medium; shapes of a shapegroup cannot have one"));
}

TEST(MediaInFiles, AShapeWithoutBsdfIsOpaqueAndSaysSo) {
  const LoadedScene loaded =
      load(kSensor + "\n<shape type=\"sphere\"><medium name=\"interior\" type=\"homogeneous\"/></shape>");
  ASSERT_EQ(loaded.warnings.size(), 1u);
  EXPECT_TRUE(contains(loaded.warnings[0], "has a medium and no bsdf, so it is diffuse"));
}

TEST(MediaInFiles, MitsubasPathTracersForMediaArePath) {
  for (const std::string type : {"volpath", "volpathmis"}) {
    const std::string extra = type == "volpathmis" ? "<boolean name=\"use_spectral_mis\" value=\"true\"/>" : "";
    EXPECT_EQ(load(kSensor + "<integrator type=\"" + type + "\">" + extra + "</integrator>").integrator_type, "path");
  }
}

}  // namespace
}  // namespace covary
