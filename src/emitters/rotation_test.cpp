// SPDX-License-Identifier: Apache-2.0
#include "emitters/rotation.h"

#include <gtest/gtest.h>

#include "core/error.h"

namespace covary {
namespace {

TEST(Rotation, KeepsLengthsAndInverts) {
  for (const Transform& t :
       {Transform::rotate({1, 2, 3}, 70), Transform::scale({-2, 2, 2}), Transform::translate({1, 2, 3}),
        Transform::scale({3, 3, 3}) * Transform::rotate({0, 1, 0}, -30)}) {
    const Rotation rotation(t);
    const Vec3 v{0.1f, -0.7f, 0.4f}, w = rotation.to_world(v);
    EXPECT_LT(length(normalize(w) - normalize(t.vector(v))), 1e-6f);
    EXPECT_NEAR(length(w), length(v), 1e-6f);
    EXPECT_LT(length(rotation.to_local(w) - v), 1e-6f);
  }
}

TEST(Rotation, SmallDistortionsAreRemoved) {
  const Rotation rotation(Transform::rotate({0, 1, 0}, 30) * Transform::scale({1, 1.01f, 1.015f}));
  EXPECT_TRUE(rotation.is_nearest());
  EXPECT_LT(length(rotation.to_world({0, 0, 1}) - Transform::rotate({0, 1, 0}, 30).vector({0, 0, 1})), 1e-6f);
  EXPECT_FALSE(Rotation(Transform::scale({3, 3.001f, 3})).is_nearest());
}

TEST(Rotation, RejectsWhatDistortsDirections) {
  for (const Vec3& scale : {Vec3{1, 2, 1}, Vec3{1, 1, 0.9f}}) {
    try {
      Rotation rotation{Transform::scale(scale)};
      FAIL() << "accepted";
    } catch (const Error& error) {
      EXPECT_EQ(std::string(error.what()),
                "distorts directions; only rotations, reflections, translations and uniform scales are accepted here");
    }
  }
  Matrix4 shear = Transform().matrix();
  shear[0][1] = 0.5;
  EXPECT_THROW(Rotation{Transform(shear)}, Error);
}

}  // namespace
}  // namespace covary
