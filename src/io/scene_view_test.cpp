// SPDX-License-Identifier: Apache-2.0
// Cameras and surroundings that a scene does not have itself.
#include "io/scene_view.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <fstream>

#include "io/convert_scene.h"
#include "io/load_scene.h"
#include "io/studio.h"
#include "support/files.h"
#include "support/same_scene.h"

namespace covary::scene_view_test {
namespace {

using test_support::contains;
using test_support::message_of;

class SceneViews : public ::testing::Test {
 protected:
  LoadedScene load(const std::string& body, const SceneView& view) {
    LoadOptions options;
    options.view = view;
    return load_scene_text("<scene version=\"3.0.0\">\n" + body + "\n</scene>\n", folder_.file("scene.xml"), options);
  }
  test_support::TemporaryFolder folder_;
};

const std::string kSensor = R"(<sensor type="perspective" id="near"><transform name="to_world">
<lookat origin="0, 1, 6" target="0, 0, 0" up="0, 1, 0"/></transform>
<film type="hdrfilm"><integer name="width" value="40"/><integer name="height" value="20"/></film></sensor>)";
const std::string kCube = "<shape type=\"cube\"/>";

TEST_F(SceneViews, ChoosesAmongTheSensors) {
  const std::string both = kSensor + R"(<sensor type="orthographic" id="far"/>)" + kCube;
  EXPECT_FALSE(load(both, {.camera = "near"}).scene->camera().settings().orthographic);
  EXPECT_TRUE(load(both, {.camera = "far"}).scene->camera().settings().orthographic);
  EXPECT_TRUE(load(both, {.camera = "2"}).scene->camera().settings().orthographic);
  EXPECT_TRUE(contains(message_of([&] { load(both, {.camera = "3"}); }),
                       "there is no camera '3'; the scene has 1 'near', 2 'far'"));
  EXPECT_TRUE(contains(message_of([&] { load(kCube, {.camera = "a"}); }), "the scene has none: use auto"));
}

/// Mitsuba's scene.cpp: 45 degrees across the largest side, at the lowest z.
TEST_F(SceneViews, ScenesWithoutSensorAreSeenAsInMitsuba) {
  const LoadedScene scene = load(R"(<shape type="cube"><transform name="to_world"><scale x="2" y="4" z="1"/>
<translate x="5" y="6" z="7"/></transform></shape>)",
                                 {});
  EXPECT_EQ(scene.width, 768);
  EXPECT_TRUE(contains(scene.warnings.at(0), "the scene has no sensor: it is seen along the z axis, as in Mitsuba"));
  const Ray middle = scene.scene->camera().ray({384, 288}, {}), left = scene.scene->camera().ray({0, 288}, {});
  const float distance = 4 / std::tan(22.5f * kPi / 180);
  const Vec3 from{5, 6, 6 - distance};
  EXPECT_LT(length(middle.at(-(middle.o.z - from.z) / middle.d.z) - from), 1e-4f);
  EXPECT_NEAR(middle.d.z, 1, 1e-5f);
  EXPECT_NEAR(std::abs(left.d.x), std::sin(22.5f * kPi / 180), 1e-5f);
  EXPECT_TRUE(
      contains(message_of([&] { load("<shape type=\"disk\">\n<sensor type=\"irradiancemeter\"/></shape>", {}); }),
               "3:1: sensor 'irradiancemeter' measures the light on its shape: a number, not a picture"));
}

/// All corners of the box are in the image, and one is within a sixth of its edge.
TEST_F(SceneViews, FramesTheBox) {
  for (const char* scale : {"1, 1, 1", "8, 1, 1", "1, 9, 1", "1, 1, 20", "0.001, 0.002, 0.001", "5, 0, 5"})
    for (const std::string& sensor : {std::string(), kSensor}) {
      std::string text = sensor + R"(<shape type="cube"><transform name="to_world"><scale value=")" + scale +
                         R"("/><translate x="3" y="-2" z="100"/></transform></shape>)";
      if (std::string(scale) == "5, 0, 5")
        text = sensor + R"(<shape type="rectangle"><transform name="to_world"><rotate x="1" angle="-90"/>
<scale value="5"/></transform></shape>)";
      const LoadedScene scene = load(text, {.camera = "auto"});
      EXPECT_EQ(scene.width, sensor.empty() ? 1280 : 40);
      const Bounds3 box = scene.scene->bounds();
      const Camera& camera = scene.scene->camera();
      float extent = 0;
      for (int i = 0; i < 8; ++i) {
        const Vec3 p{i & 1 ? box.upper.x : box.lower.x, i & 2 ? box.upper.y : box.lower.y,
                     i & 4 ? box.upper.z : box.lower.z};
        const Vec3 local = camera.settings().to_world.inverse().point(p);
        ASSERT_GT(local.z, 0) << scale;
        const float slope = std::tan(20 * kPi / 180);  // of the shorter side, the height
        const float aspect = static_cast<float>(scene.width) / static_cast<float>(scene.height);
        extent = std::max({extent, std::abs(local.x) / local.z / slope / aspect, std::abs(local.y) / local.z / slope});
      }
      EXPECT_LT(extent, 1) << scale;
      EXPECT_GT(extent, 0.8) << scale;
    }
}

TEST_F(SceneViews, ScenesWithoutLightStandInAStudio) {
  const LoadedScene scene = load(kSensor + kCube, {.environment = "auto"});
  ASSERT_EQ(scene.warnings.size(), 1u);
  EXPECT_TRUE(contains(scene.warnings[0], "the scene has no light: it is lit by a studio with a floor"));
  ASSERT_TRUE(scene.scene->environment());
  SurfaceHit hit;  // the floor, under the cube and far away
  ASSERT_TRUE(scene.scene->intersect({{9, 2, 0}, {0, -1, 0}}, hit));
  EXPECT_NEAR(hit.p.y, -1, 0.01);
  EXPECT_LT(hit.p.y, -1);
  EXPECT_GT(dot(hit.frame.n, {0, 1, 0}), 0.999f);
  // The scene's own light is enough, or nothing is wanted.
  EXPECT_FALSE(load(kSensor + kCube + R"(<emitter type="point"/>)", {.environment = "auto"}).scene->environment());
  EXPECT_FALSE(load(kSensor + kCube, {.environment = "none"}).scene->environment());
}

/// The irradiance of the unshadowed floor times its reflectance over pi is the radiance at the horizon: no seam.
TEST_F(SceneViews, TheFloorMergesIntoTheHorizon) {
  const LoadedScene scene = load(kSensor + kCube, {.environment = "studio"});
  EXPECT_TRUE(scene.warnings.empty());
  const Emitter& light = *scene.scene->environment();
  constexpr int kN = 500;
  double irradiance = 0;
  for (int i = 0; i < kN; ++i)
    for (int k = 0; k < kN; ++k) {
      const double z = (i + 0.5) / kN, phi = 2 * M_PI * (k + 0.5) / kN, r = std::sqrt(1 - z * z);
      const Vec3 d{static_cast<float>(r * std::cos(phi)), static_cast<float>(z), static_cast<float>(r * std::sin(phi))};
      irradiance += light.environment(d).radiance.g * z * 2 * M_PI / kN / kN;
    }
  EXPECT_NEAR(irradiance * kStudioFloor / M_PI, kStudioHorizon, 0.002);
  for (const Vec3& d : {Vec3{1, 0, 0}, Vec3{0, 0, -1}, normalize(Vec3{1, -0.5f, 1})})
    EXPECT_NEAR(light.environment(d).radiance.g, kStudioHorizon, 0.006);
  // The key light comes from the viewer's left.
  EXPECT_GT(light.environment(normalize(Vec3{-0.5f, 1.2f, 0.6f})).radiance.g,
            4 * light.environment(normalize(Vec3{0.5f, 1.2f, 0.6f})).radiance.g);
}

TEST_F(SceneViews, OtherSurroundings) {
  const std::string own = kSensor + kCube + R"(<emitter type="constant"><rgb name="radiance" value="7"/></emitter>)";
  const Vec3 up{0, 1, 0};
  EXPECT_EQ(load(own, {.environment = "auto"}).scene->environment()->environment(up).radiance.r, 7);
  const LoadedScene white = load(own, {.environment = "white"});
  EXPECT_EQ(white.scene->environment()->environment(up).radiance, Spectrum(1));
  EXPECT_TRUE(contains(white.warnings.at(0), "this light from all around is replaced"));
  const LoadedScene sky = load(own, {.environment = "sky"});
  EXPECT_EQ(sky.scene->environment()->environment({0, -1, 0}).radiance, Spectrum(0));
  const Spectrum zenith = sky.scene->environment()->environment(up).radiance;
  EXPECT_GT(zenith.b, zenith.r);
  std::ofstream(folder_.file("grey.pfm"), std::ios::binary) << "Pf\n1 1\n-1.0\n" + std::string("\0\0\0\x40", 4);
  const LoadedScene file = load(own, {.environment = folder_.file("grey.pfm")});
  EXPECT_EQ(file.scene->environment()->environment(up).radiance, Spectrum(2));
  EXPECT_TRUE(contains(message_of([&] { load(own, {.environment = "/absent.exr"}); }), "absent.exr"));
  // Hashes tell views apart; the default's does not change.
  EXPECT_NE(white.content_hash, sky.content_hash);
  EXPECT_EQ(load(own, {}).content_hash, load(own, {.environment = "auto"}).content_hash);
}

/// As bright as the other surroundings: a background or an exposure that suits one suits the sky, too.
TEST_F(SceneViews, AWhiteLevelSurfaceReflectsAboutOneUnderTheSky) {
  const LoadedScene scene = load(kSensor + kCube, {.environment = "sky"});
  constexpr int kN = 64;
  double reflected = 0;
  for (int i = 0; i < kN * kN * kN; ++i) {
    const auto at = [](int k) { return (static_cast<float>(k % kN) + 0.5f) / kN; };
    const EmitterSample s = scene.scene->environment()->sample_towards({}, {at(i), at(i / kN)}, at(i / kN / kN));
    if (s.pdf_solid_angle > 0) reflected += s.radiance.g * std::max(s.wi.y, 0.0f) / s.pdf_solid_angle / M_PI;
  }
  EXPECT_NEAR(reflected / (kN * kN * kN), 1, 0.2);
}

TEST_F(SceneViews, TheBackgroundShedsNoLight) {
  const LoadedScene scene = load(kSensor + kCube, {.environment = "white", .background = Spectrum(0.1f, 0.2f, 0.4f)});
  ASSERT_TRUE(scene.scene->background());
  EXPECT_EQ(scene.scene->background()->environment({0, 1, 0}).radiance, Spectrum(0.1f, 0.2f, 0.4f));
  EXPECT_EQ(scene.scene->environment()->environment({0, 1, 0}).radiance, Spectrum(1));
  EXPECT_EQ(scene.scene->emitters().size(), 1u);
}

/// A converted scene has what was added.
TEST_F(SceneViews, IsConvertedWithTheScene) {
  std::ofstream(folder_.file("scene.xml")) << "<scene version=\"3.0.0\">" << kCube << "</scene>";
  LoadOptions options;
  options.view = {.environment = "auto", .camera = "auto"};
  const ConvertedScene converted = convert_scene(folder_.file("scene.xml"), folder_.file("out.xml"), options);
  std::ofstream(folder_.file("out.xml")) << converted.document.xml;
  std::filesystem::create_directory(folder_.file("out-files"));
  for (const SceneDocumentFile& part : converted.document.files)
    std::ofstream(folder_.file(part.path), std::ios::binary) << part.bytes;
  test_support::expect_same_scene(load_scene(folder_.file("scene.xml"), options), load_scene(folder_.file("out.xml")),
                                  100);
}

}  // namespace
}  // namespace covary::scene_view_test
