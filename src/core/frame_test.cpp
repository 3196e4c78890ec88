// SPDX-License-Identifier: Apache-2.0
#include "core/frame.h"

#include <gtest/gtest.h>

#include "core/random.h"
#include "core/warp.h"

namespace covary {
namespace {

Vec3 random_direction(uint64_t i) {
  return warp::square_to_sphere(PathRandom(Sampling::kIndependent, 3, 0, 0, i).get_2d(0, Event::kDirection));
}

double orthonormality_error(const Frame& f) {
  return std::max({std::abs(dot(f.s, f.t)), std::abs(dot(f.s, f.n)), std::abs(dot(f.t, f.n)), std::abs(length(f.s) - 1),
                   length(cross(f.s, f.t) - f.n)});
}

TEST(Frame, IsOrthonormalAndRightHandedEverywhere) {
  for (uint64_t i = 0; i < 100000; ++i) {
    // Every second normal lies near the antipode of the pole, where the construction switches.
    const Vec3 d = random_direction(i);
    const Vec3 n = i % 2 ? d : normalize(Vec3{-0.48f, -0.64f, -0.6f} + d * 0.2f);
    ASSERT_LT(orthonormality_error(Frame(n)), 1e-4) << n.x << " " << n.y << " " << n.z;
  }
  EXPECT_LT(orthonormality_error(Frame(Vec3{-0.48f, -0.64f, -0.6f})), 1e-6);
}

TEST(Frame, IsContinuousWhereWallsHaveTheirNormals) {
  for (const Vec3& axis :
       {Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}, Vec3{-1, 0, 0}, Vec3{0, -1, 0}, Vec3{0, 0, -1}}) {
    const Frame exact(axis);
    for (uint64_t i = 0; i < 100; ++i) {
      const Frame near_frame(normalize(axis + random_direction(i) * 1e-3f));
      EXPECT_LT(length(near_frame.s - exact.s), 1e-2f);
      EXPECT_LT(length(near_frame.t - exact.t), 1e-2f);
    }
  }
}

TEST(Frame, LocalAndWorldAreInverse) {
  const Frame frame(normalize(Vec3{1, 2, -3}));
  const Vec3 v{0.3f, -0.2f, 0.9f};
  EXPECT_LT(length(frame.to_world(frame.to_local(v)) - v), 1e-6f);
  EXPECT_NEAR(frame.to_local(frame.n).z, 1, 1e-6f);
}

TEST(Frame, FromTangentKeepsTheTangentsDirection) {
  const Vec3 n = normalize(Vec3{1, 1, 1});
  const Frame frame = Frame::from_tangent(n, {5, 1, 0});
  EXPECT_LT(orthonormality_error(frame), 1e-5);
  EXPECT_NEAR(dot(frame.t, Vec3{5, 1, 0}), 0, 1e-5f);
  EXPECT_GT(dot(frame.s, Vec3{5, 1, 0}), 0);
  EXPECT_LT(orthonormality_error(Frame::from_tangent(n, n)), 1e-5);  // no tangent: any frame
}

}  // namespace
}  // namespace covary
