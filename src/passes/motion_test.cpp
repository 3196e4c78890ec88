// SPDX-License-Identifier: Apache-2.0
// Points whose position in the previous frame is known in closed form.
#include "passes/motion.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "io/load_scene.h"

namespace covary {
namespace {

constexpr int kWidth = 20, kHeight = 10;

/// A wall at z = 5 covering x > 0 (on the left of the image) in the view from the origin along z.
LoadedScene wall(const std::string& sensor = "perspective") {
  return load_scene_text(
      fmt::format(R"(<scene version="3.0.0">
    <sensor type="{}">{}<film type="hdrfilm"><integer name="width" value="{}"/><integer name="height" value="{}"/>
      </film></sensor>
    <shape type="rectangle"><transform name="to_world"><rotate y="1" angle="180"/><scale value="50"/>
      <translate x="50" z="5"/></transform></shape>
    <emitter type="constant"/></scene>)",
                  sensor, sensor == "perspective" ? R"(<float name="fov" value="50"/>)" : "", kWidth, kHeight),
      "wall.xml");
}

Camera moved(const LoadedScene& scene, const Transform& to_world) {
  CameraSettings settings = scene.camera->settings();
  settings.to_world = to_world;
  return {settings, kWidth, kHeight};
}

constexpr CropWindow kFrame{0, 0, kWidth, kHeight};

TEST(MotionImages, AreZeroForACameraAtRest) {
  const LoadedScene scene = wall();
  const MotionImages images = motion_images(*scene.scene, *scene.camera, 0, kFrame);
  for (const float value : images.motion.data) EXPECT_NEAR(value, 0, 1e-4f);
  EXPECT_EQ(*images.depth.pixel(15, 3), 0) << "nothing there";
  EXPECT_NEAR(*images.depth.pixel(9, 5), 5, 0.02f);
  EXPECT_GT(*images.depth.pixel(0, 5), 5.4f) << "along the ray, not along the axis";
}

TEST(MotionImages, LeadToThePointInTheFrameBefore) {
  const LoadedScene scene = wall();
  // 0.3 to the left, 0.2 up and 1 farther away: the camera has moved to the origin since.
  const MotionImages images =
      motion_images(*scene.scene, moved(scene, Transform::translate({0.3f, 0.2f, -1})), 0, kFrame);
  const double half = std::tan(25 * M_PI / 180), pixel = kWidth / (2 * half);  // pixels per unit at distance 1
  for (const int x : {0, 4, 9})
    for (const int y : {0, 7}) {
      const double wx = (kWidth / 2.0 - (x + 0.5)) / pixel * 5, wy = (kHeight / 2.0 - (y + 0.5)) / pixel * 5;
      const float* motion = images.motion.pixel(x, y);
      EXPECT_NEAR(motion[0], kWidth / 2.0 - pixel * (wx - 0.3) / 6 - (x + 0.5), 1e-3) << x << ' ' << y;
      EXPECT_NEAR(motion[1], kHeight / 2.0 - pixel * (wy - 0.2) / 6 - (y + 0.5), 1e-3) << x << ' ' << y;
      EXPECT_NEAR(motion[2], std::hypot(wx - 0.3, wy - 0.2, 6) - std::hypot(wx, wy, 5), 1e-3);
    }
  const float* sky = images.motion.pixel(15, 3);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(sky[c], 0, 1e-4f) << "the point is at infinity, the camera has not turned";
}

TEST(MotionImages, FollowATurnAtAnyDistance) {
  const LoadedScene scene = wall();
  const MotionImages images = motion_images(*scene.scene, moved(scene, Transform::rotate({0, 1, 0}, 5)), 0, kFrame);
  // The camera looked 5 degrees towards x, which is left: the middle of the image was to the right.
  const double pixel = kWidth / (2 * std::tan(25 * M_PI / 180));
  const double angle = std::atan((9.5 - kWidth / 2.0) / pixel) + 5 * M_PI / 180;
  EXPECT_NEAR(images.motion.pixel(9, 5)[0], kWidth / 2.0 + pixel * std::tan(angle) - 9.5, 1e-3);
  EXPECT_NEAR(images.motion.pixel(9, 5)[2], 0, 1e-4f);
  const double sky_angle = std::atan((15.5 - kWidth / 2.0) / pixel) + 5 * M_PI / 180;
  EXPECT_NEAR(images.motion.pixel(15, 5)[0], kWidth / 2.0 + pixel * std::tan(sky_angle) - 15.5, 1e-3);
}

TEST(MotionImages, LeadOutOfTheFrameWhereThePointWasBehindTheCamera) {
  const LoadedScene scene = wall();
  const MotionImages images = motion_images(*scene.scene, moved(scene, Transform::rotate({0, 1, 0}, 180)), 0, kFrame);
  for (const int x : {3, 15}) {
    EXPECT_EQ(images.motion.pixel(x, 5)[0], kWidth);
    EXPECT_EQ(images.motion.pixel(x, 5)[1], 0);
  }
}

TEST(MotionImages, OfParallelRaysFollowTheScaleOfTheFrame) {
  const LoadedScene scene = wall("orthographic");
  const MotionImages images =
      motion_images(*scene.scene, moved(scene, Transform::translate({0.5f, 0.25f, -2})), 0, kFrame);
  const float* motion = images.motion.pixel(3, 5);
  EXPECT_NEAR(*images.depth.pixel(3, 5), 5, 1e-4f);
  EXPECT_NEAR(motion[0], 0.5f * kWidth / 2, 1e-4f);
  EXPECT_NEAR(motion[1], 0.25f * kWidth / 2, 1e-4f);
  EXPECT_NEAR(motion[2], 2, 1e-4f);
}

/// A square in front of the camera rotates about the viewing axis, 30 degrees per frame, while it comes nearer.
TEST(MotionImages, FollowShapesThatMove) {
  const LoadedScene scene = load_scene_text(fmt::format(R"(<scene version="3.0.0">
    <sensor type="perspective"><float name="fov" value="50"/><film type="hdrfilm">
      <integer name="width" value="{}"/><integer name="height" value="{}"/></film></sensor>
    <shape type="rectangle"><animation name="to_world">
      <transform time="0"><rotate y="1" angle="180"/><translate z="7"/></transform>
      <transform time="2"><rotate y="1" angle="180"/><rotate z="1" angle="60"/><translate z="3"/></transform>
    </animation></shape></scene>)",
                                                        kWidth, kHeight),
                                            "turning.xml");
  scene.scene->move_to(1);
  const MotionImages images = motion_images(*scene.scene, *scene.camera, 0, kFrame);
  const double pixel = kWidth / (2 * std::tan(25 * M_PI / 180)), c = std::cos(M_PI / 6), s = std::sin(M_PI / 6);
  for (const int x : {9, 10, 11}) {
    const double wx = (kWidth / 2.0 - (x + 0.5)) / pixel * 5, wy = (kHeight / 2.0 - 3.5) / pixel * 5;
    const double old_x = c * wx + s * wy, old_y = c * wy - s * wx;
    const float* motion = images.motion.pixel(x, 3);
    EXPECT_NEAR(motion[0], kWidth / 2.0 - pixel * old_x / 7 - (x + 0.5), 1e-3) << x;
    EXPECT_NEAR(motion[1], kHeight / 2.0 - pixel * old_y / 7 - 3.5, 1e-3) << x;
    EXPECT_NEAR(motion[2], std::hypot(wx, wy, 7) - std::hypot(wx, wy, 5), 1e-3) << x;
  }
  EXPECT_EQ(*images.depth.pixel(0, 5), 0) << "beside it";
  EXPECT_NEAR(images.motion.pixel(0, 5)[0], 0, 1e-4f);
}

TEST(MotionImages, OfAWindowAreThoseOfTheFrame) {
  const LoadedScene scene = wall();
  const Camera previous = moved(scene, Transform::translate({0.3f, 0.2f, -1}));
  const MotionImages all = motion_images(*scene.scene, previous, 0, kFrame);
  const MotionImages part = motion_images(*scene.scene, previous, 0, {4, 2, 9, 3});
  for (int c = 0; c < 3; ++c) EXPECT_EQ(part.motion.pixel(2, 1)[c], all.motion.pixel(6, 3)[c]);
  EXPECT_EQ(*part.depth.pixel(2, 1), *all.depth.pixel(6, 3));
}

}  // namespace
}  // namespace covary
