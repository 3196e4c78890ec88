// SPDX-License-Identifier: Apache-2.0
#include "core/transform.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/error.h"

namespace covary {
namespace {

void expect_near(const Vec3& a, const Vec3& b, float tolerance = 1e-5f) {
  EXPECT_LT(length(a - b), tolerance) << "(" << a.x << ", " << a.y << ", " << a.z << ") is not (" << b.x << ", " << b.y
                                      << ", " << b.z << ")";
}

template <typename F>
std::string message_of(const F& f) {
  try {
    f();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kInput);
    return error.what();
  }
  return "";
}

const Transform kGeneral =
    Transform::translate({1, -2, 3}) * Transform::rotate({1, 2, -1}, 40) * Transform::scale({2, 0.5f, -3});
const Vec3 kPoints[] = {{0, 0, 0}, {1, 2, 3}, {-0.3f, 0.7f, 11}};

TEST(Transform, BasicMaps) {
  const Vec3 p{1, 2, 3};
  expect_near(Transform().point(p), p);
  expect_near(Transform::translate({1, 1, 1}).point(p), {2, 3, 4});
  expect_near(Transform::translate({1, 1, 1}).vector(p), p);
  expect_near(Transform::scale({2, 3, 4}).point(p), {2, 6, 12});
  expect_near(Transform::rotate({0, 0, 5}, 90).point({1, 0, 0}), {0, 1, 0});
  expect_near(Transform::rotate({1, 0, 0}, 90).point({0, 1, 0}), {0, 0, 1});
  expect_near(Transform::rotate({1, 1, 1}, 120).point({1, 0, 0}), {0, 1, 0});
}

TEST(Transform, ProductsApplyTheRightOneFirst) {
  const Transform a = Transform::translate({1, 0, 0}), b = Transform::rotate({0, 0, 1}, 90);
  for (const Vec3& p : kPoints) expect_near((a * b).point(p), a.point(b.point(p)));
  expect_near((a * b).point({1, 0, 0}), {1, 1, 0});
}

TEST(Transform, InverseUndoes) {
  for (const Vec3& p : kPoints) {
    expect_near(kGeneral.inverse().point(kGeneral.point(p)), p, 1e-4f);
    expect_near(kGeneral.inverse().vector(kGeneral.vector(p)), p, 1e-4f);
  }
  // Far from the origin at a tiny scale: needs double precision.
  const Transform far = Transform::translate({1e5f, 0, 0}) * Transform::scale({1e-6f, 1e-6f, 1e-6f});
  expect_near((far.inverse() * far).point({1, 2, 3}), {1, 2, 3}, 1e-3f);
}

TEST(Transform, NormalsStayPerpendicular) {
  const Vec3 n{0, 0.6f, 0.8f}, tangents[] = {{1, 0, 0}, {0, 0.8f, -0.6f}};
  for (const Vec3& t : tangents) EXPECT_NEAR(dot(kGeneral.normal(n), kGeneral.vector(t)), 0, 1e-5f);
  EXPECT_GT(std::abs(dot(kGeneral.vector(n), kGeneral.vector(tangents[1]))), 0.1f);  // vector() would not do
}

TEST(Transform, LookAtSeesTheTargetAlongZ) {
  const Vec3 origin{1, 2, 3}, target{4, 2, -1}, up{0, 1, 0};
  const Transform camera = Transform::look_at(origin, target, up);
  expect_near(camera.point({0, 0, 0}), origin);
  expect_near(camera.point({0, 0, 5}), target);
  expect_near(camera.vector({0, 1, 0}), up);
  // Right-handed with x to the left as seen from the camera.
  expect_near(camera.vector({1, 0, 0}), normalize(cross(up, target - origin)));
  EXPECT_FALSE(camera.flips_handedness());
}

TEST(Transform, KnowsHandednessAndIdentity) {
  EXPECT_TRUE(kGeneral.flips_handedness());
  EXPECT_FALSE((kGeneral * kGeneral).flips_handedness());
  EXPECT_TRUE(Transform().is_identity());
  EXPECT_TRUE(Transform::translate({0, 0, 0}).is_identity());
  EXPECT_FALSE(kGeneral.is_identity());
}

TEST(Transform, DividesByTheFourthCoordinate) {
  const Transform perspective(Matrix4{{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 1}, {0, 0, 1, 0}}});
  expect_near(perspective.point({2, 4, 2}), {1, 2, 1.5f});
}

TEST(Transform, BoundsHoldAllCorners) {
  Bounds3 box;
  box.extend(Vec3{-1, 0, 2});
  box.extend(Vec3{1, 3, 4});
  const Bounds3 moved = kGeneral.bounds(box);
  for (int i = 0; i < 8; ++i) {
    const Vec3 p = kGeneral.point({i & 1 ? 1.0f : -1.0f, i & 2 ? 3.0f : 0.0f, i & 4 ? 4.0f : 2.0f});
    for (int k = 0; k < 3; ++k) {
      EXPECT_GE(p[k], moved.lower[k] - 1e-5f);
      EXPECT_LE(p[k], moved.upper[k] + 1e-5f);
    }
  }
  EXPECT_TRUE(kGeneral.bounds(Bounds3{}).empty());
  const Bounds3 same = Transform().bounds(box);
  expect_near(same.lower, box.lower);
  expect_near(same.upper, box.upper);
}

TEST(Transform, RefusesWhatHasNoInverse) {
  EXPECT_EQ(message_of([] { Transform::scale({1, 0, 1}); }), "the transformation matrix is singular");
  EXPECT_EQ(message_of([] {
              Transform::translate({1, NAN, 1});
            }),
            "the transformation matrix has an entry that is not finite");
  EXPECT_EQ(message_of([] {
              Transform::scale({INFINITY, 1, 1});
            }),
            "the transformation matrix has an entry that is not finite");
  EXPECT_EQ(message_of([] { Transform::rotate({0, 0, 0}, 30); }), "the axis of a rotation has length zero");
  EXPECT_EQ(message_of([] {
              Transform::look_at({1, 1, 1}, {1, 1, 1}, {0, 1, 0});
            }),
            "look_at: origin and target are the same point");
  EXPECT_EQ(message_of([] {
              Transform::look_at({0, 0, 0}, {0, 5, 0}, {0, 1, 0});
            }),
            "look_at: the up vector is zero or parallel to the viewing direction");
  EXPECT_EQ(message_of([] {
              Transform::look_at({0, 0, 0}, {0, 0, 5}, {0, 0, 0});
            }),
            "look_at: the up vector is zero or parallel to the viewing direction");
}

}  // namespace
}  // namespace covary
