// SPDX-License-Identifier: Apache-2.0
#include "scene/camera.h"

#include <gtest/gtest.h>

#include "core/error.h"

namespace covary {
namespace {

float degrees_between(const Vec3& a, const Vec3& b) { return std::acos(std::min(1.0f, dot(a, b))) * 180 / kPi; }

CameraSettings settings_with(FovAxis axis, float fov) {
  CameraSettings settings;
  settings.fov_axis = axis;
  settings.fov_degrees = fov;
  return settings;
}

TEST(Camera, FieldOfViewSpansTheNamedAxis) {
  struct Case {
    FovAxis axis;
    int width, height;
    Vec2 a, b;
  };
  for (const Case& c :
       {Case{FovAxis::kX, 300, 200, {0, 100}, {300, 100}}, Case{FovAxis::kY, 300, 200, {150, 0}, {150, 200}},
        Case{FovAxis::kDiagonal, 300, 200, {0, 0}, {300, 200}}, Case{FovAxis::kSmaller, 300, 200, {150, 0}, {150, 200}},
        Case{FovAxis::kSmaller, 200, 300, {0, 150}, {200, 150}}, Case{FovAxis::kLarger, 300, 200, {0, 100}, {300, 100}},
        Case{FovAxis::kLarger, 200, 300, {100, 0}, {100, 300}}}) {
    const Camera camera(settings_with(c.axis, 64), c.width, c.height);
    EXPECT_NEAR(degrees_between(camera.ray(c.a, {}).d, camera.ray(c.b, {}).d), 64, 1e-3f) << static_cast<int>(c.axis);
  }
}

TEST(Camera, LooksAlongZWithXToTheLeftAndYUp) {
  const Camera camera(settings_with(FovAxis::kX, 90), 100, 50);
  EXPECT_NEAR(camera.ray({50, 25}, {}).d.z, 1, 1e-6f);
  EXPECT_GT(camera.ray({0, 25}, {}).d.x, 0.7f);  // left edge
  EXPECT_GT(camera.ray({50, 0}, {}).d.y, 0.4f);  // top edge
}

TEST(Camera, ClipsAtNearAndFarPlanes) {
  CameraSettings settings = settings_with(FovAxis::kX, 90);
  settings.near_clip = 2, settings.far_clip = 10;
  const Camera camera(settings, 100, 100);
  const Ray ray = camera.ray({0, 30}, {});
  EXPECT_NEAR(ray.o.z, 2, 1e-5f);
  EXPECT_NEAR(ray.at(ray.t_max).z, 10, 1e-4f);
}

TEST(Camera, PrincipalPointOffsetShiftsTheImage) {
  CameraSettings settings = settings_with(FovAxis::kX, 50);
  const Vec3 expected = Camera(settings, 100, 100).ray({60, 30}, {}).d;
  settings.principal_point_offset = {0.1f, -0.2f};
  const Vec3 shifted = Camera(settings, 100, 100).ray({50, 50}, {}).d;
  EXPECT_LT(length(shifted - expected), 1e-6f);
}

TEST(Camera, ThinLensRaysMeetInTheFocalPlane) {
  CameraSettings settings = settings_with(FovAxis::kX, 50);
  settings.aperture_radius = 0.3f, settings.focus_distance = 4;
  const Camera camera(settings, 100, 100);
  const Ray a = camera.ray({20, 70}, {0.1f, 0.9f}), b = camera.ray({20, 70}, {0.8f, 0.3f});
  const Vec3 pa = a.at((4 - a.o.z) / a.d.z), pb = b.at((4 - b.o.z) / b.d.z);
  EXPECT_LT(length(pa - pb), 1e-5f);
  EXPECT_GT(length(a.o - b.o), 0.1f);
}

TEST(Camera, RefusesScale) {
  CameraSettings settings;
  settings.to_world = Transform::scale({2, 2, 2});
  try {
    const Camera camera(settings, 10, 10);
    FAIL();
  } catch (const Error& error) {
    EXPECT_STREQ(error.what(), "the to_world transformation of a sensor must not scale");
  }
}

TEST(Camera, OrthographicRaysAreParallel) {
  CameraSettings settings;
  settings.orthographic = true, settings.near_clip = 2, settings.far_clip = 10;
  settings.to_world = Transform::translate({5, 0, 0}) * Transform::scale({3, 3, 1});
  const Camera camera(settings, 100, 50);
  const Ray middle = camera.ray({50, 25}, {}), corner = camera.ray({0, 0}, {});
  EXPECT_EQ(middle.d, (Vec3{0, 0, 1}));
  EXPECT_EQ(corner.d, middle.d);
  EXPECT_EQ(middle.t_max, 8);
  EXPECT_LT(length(middle.o - Vec3{5, 0, 2}), 1e-5f);
  EXPECT_LT(length(corner.o - Vec3{8, 1.5f, 2}), 1e-5f);  // x to the left, y up
}

}  // namespace
}  // namespace covary
