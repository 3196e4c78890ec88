// SPDX-License-Identifier: Apache-2.0
// At each time, an animated scene equals the static scene with everything placed as at that time.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "core/random.h"
#include "io/load_scene.h"
#include "support/files.h"

namespace covary {
namespace {

using test_support::contains;
using test_support::message_of;

constexpr const char* kFilm = R"(<film type="hdrfilm"><integer name="width" value="8"/>
<integer name="height" value="8"/></film>)";

std::string key(double time) {
  return fmt::format(R"(<transform time="{}"><scale value="0.5"/><rotate x="1" y="2" angle="{}"/>
<translate x="{}" y="0.25"/></transform>)",
                     time, 40 * time, 0.75 * time - 1);
}

/// A scene of these shapes; "TO_WORLD" in moving ones is replaced by the animation, or by one of its keys.
LoadedScene scene_of(std::string shapes, const std::string& to_world) {
  for (size_t at; (at = shapes.find("TO_WORLD")) != std::string::npos;) shapes.replace(at, 8, to_world);
  return load_scene_text(
      fmt::format(R"(<scene version="3.0.0"><sensor type="perspective">{}</sensor>{}</scene>)", kFilm, shapes),
      "s.xml");
}

LoadedScene moving(const std::string& shapes) {
  return scene_of(shapes, "<animation name=\"to_world\">" + key(0) + key(1) + key(3) + "</animation>");
}

LoadedScene resting(const std::string& shapes, double time) {
  std::string rests = key(time);
  rests.replace(rests.find("time"), rests.find('>') - rests.find("time"), "name=\"to_world\"");
  return scene_of(shapes, rests);
}

/// Number of 2,000 rays through the middle that hit something; each must hit the same in both.
int n_same_hits(const LoadedScene& a, const LoadedScene& b) {
  int n = 0;
  for (int i = 0; i < 2000; ++i) {
    const PathRandom random(Sampling::kIndependent, 3, 0, 0, i);
    const Vec2 u = random.get_2d(0, Event::kDirection), v = random.get_2d(1, Event::kDirection);
    const Vec3 from{8 * u.x - 4, 4 * u.y - 2, 6}, to{3 * v.x - 1.5f, 2 * v.y - 0.75f, 0};
    SurfaceHit one, other;
    const bool found = a.scene->intersect({from, normalize(to - from)}, one);
    EXPECT_EQ(b.scene->intersect({from, normalize(to - from)}, other), found) << i;
    if (!found) continue;
    ++n;
    EXPECT_NEAR(one.t, other.t, 1e-4f) << i;
    EXPECT_LT(length(one.ng - other.ng), 1e-3f) << i;
    EXPECT_LT(length(one.frame.n - other.frame.n), 1e-3f) << i;
    EXPECT_EQ(one.emitter == nullptr, other.emitter == nullptr) << i;
  }
  return n;
}

constexpr const char* kShapes[] = {
    R"(<shape type="cube">TO_WORLD</shape>)",
    R"(<shape type="sphere">TO_WORLD</shape>)",
    R"(<shape type="disk">TO_WORLD</shape>)",
    R"(<shape type="cylinder">TO_WORLD<float name="radius" value="0.6"/><boolean name="flip_normals" value="true"/>
       <bsdf type="conductor"/></shape>)",
    R"(<shape type="rectangle">TO_WORLD<emitter type="area"><rgb name="radiance" value="1 2 3"/></emitter></shape>)",
    R"(<shape type="shapegroup" id="g"><shape type="sphere"/><shape type="cube"><transform name="to_world">
       <translate x="1"/></transform></shape></shape><shape type="instance">TO_WORLD<ref id="g"/></shape>)",
    R"(<shape type="shapegroup" id="g"><shape type="sphere"><emitter type="area"/></shape><shape type="cube"/></shape>
       <shape type="instance">TO_WORLD<ref id="g"/></shape>)",
};

TEST(Animation, PlacesEachShapeWhereItIs) {
  for (const std::string shape : kShapes) {
    const std::string shapes =
        R"(<shape type="cube"><transform name="to_world"><translate z="-2"/></transform></shape>)" + shape +
        R"(<emitter type="constant"/>)";
    const LoadedScene scene = moving(shapes);
    for (const double time : {0.0, 3.0, 1.0}) {  // back and forth
      scene.scene->move_to(time);
      const LoadedScene alone = resting(shapes, time);
      EXPECT_GT(n_same_hits(scene, alone), 500) << shape << time;
      EXPECT_LT(length(scene.scene->bounds().lower - alone.scene->bounds().lower), 1e-4f);
      ASSERT_EQ(scene.scene->emitters().size(), alone.scene->emitters().size());
      for (size_t i = 0; i < scene.scene->emitters().size(); ++i) {
        const Emitter &a = *scene.scene->emitters()[i], &b = *alone.scene->emitters()[i];
        const EmitterSample s = a.sample_towards({0, 0, 5}, {0.3f, 0.6f}, 0.2f);
        const EmitterSample t = b.sample_towards({0, 0, 5}, {0.3f, 0.6f}, 0.2f);
        EXPECT_LT(length(s.wi - t.wi), 1e-3f) << shape << time;
        EXPECT_NEAR(s.pdf_solid_angle / t.pdf_solid_angle, 1, 1e-3f) << shape << time;
      }
    }
  }
}

TEST(Animation, MovesTheSameWhateverTheWay) {
  const LoadedScene one = moving(kShapes[0]), other = moving(kShapes[0]);
  for (const double time : {2.5, 0.1, 1.7}) one.scene->move_to(time);
  other.scene->move_to(1.7);
  for (int i = 0; i < 500; ++i) {
    const Ray ray{{0.004f * i - 1, 0.1f, 6}, {0, 0, -1}};
    SurfaceHit a, b;
    ASSERT_EQ(one.scene->intersect(ray, a), other.scene->intersect(ray, b));
    EXPECT_EQ(a.t, b.t);
  }
}

TEST(Animation, OfASensorStandsAtTheTimeOfItsShutter) {
  const auto load = [](const std::string& more) {
    return load_scene_text(fmt::format(R"(<scene version="3.0.0"><sensor type="perspective">{}{}
<animation name="to_world"><transform time="1"/><transform time="3"><translate x="4"/></transform></animation></sensor>
<shape type="cube"><animation name="to_world">{}{}</animation></shape></scene>)",
                                       kFilm, more, key(0), key(2)),
                           "s.xml");
  };
  const auto x = [](const LoadedScene& scene) { return scene.camera->settings().to_world.matrix()[0][3]; };
  EXPECT_EQ(x(load("")), 0);
  const LoadedScene later =
      load(R"(<float name="shutter_open" value="1.5"/><float name="shutter_close" value="1.5"/>)");
  EXPECT_EQ(x(later), 1);
  EXPECT_EQ(later.scene->time(), 1.5);
  EXPECT_EQ(later.camera_to_world->last_time(), 3);
  EXPECT_EQ(message_of([&] { load(R"(<float name="shutter_close" value="0.5"/>)"); }),
            "s.xml:1:24: the shutter is open from 0 to 0.5, and there is an <animation>: motion is not blurred; "
            "shutter_close must be shutter_open, the time of the image");
}

TEST(Animation, IsForShapesInstancesAndSensors) {
  for (const char* shapes : {R"(<emitter type="directional">TO_WORLD</emitter>)",
                             R"(<shape type="shapegroup" id="g"><shape type="cube">TO_WORLD</shape></shape>
<shape type="instance"><ref id="g"/></shape>)"}) {
    const std::string message = message_of([&] { moving(shapes); });
    EXPECT_TRUE(contains(message, "must be a transform, not an animation")) << message;
  }
  const char* const grows = R"(<shape type="sphere"><animation name="to_world"><transform time="0"/>
<transform time="1"><scale x="2"/></transform></animation></shape>)";
  const LoadedScene scene = moving(grows);
  const std::string stretched = message_of([&] { scene.scene->move_to(1); });
  EXPECT_TRUE(stretched.starts_with("s.xml:")) << stretched;
}

}  // namespace
}  // namespace covary
