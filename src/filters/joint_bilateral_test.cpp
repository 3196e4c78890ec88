// SPDX-License-Identifier: Apache-2.0
#include "filters/joint_bilateral.h"

#include <gtest/gtest.h>

#include <limits>

#include "core/error.h"
#include "core/random.h"

namespace covary {
namespace {

constexpr int kSide = 24;

/// An image with `value(x, y)` in all channels.
template <typename Value>
Image image(const Value& value) {
  Image result(kSide, kSide, 3);
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x)
      for (int c = 0; c < 3; ++c) result.pixel(x, y)[c] = value(x, y);
  return result;
}

float noise(int x, int y) { return static_cast<float>(mix64(y * kSide + x) >> 40) * 0x1p-24f; }

Image constant(float value) {
  return image([value](int, int) { return value; });
}

TEST(JointBilateral, SmoothsNoiseWhereFeaturesAreFlat) {
  const Image result = joint_bilateral(image(noise), constant(0.5f), constant(0));
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x) EXPECT_NEAR(result.pixel(x, y)[1], 0.5f, 0.15f);
}

TEST(JointBilateral, KeepsEdgesOfAlbedoAndNormal) {
  const auto step = [](int x, int) { return x < kSide / 2 ? 0.0f : 1.0f; };
  for (const bool in_albedo : {false, true}) {
    const Image result =
        joint_bilateral(image(step), in_albedo ? image(step) : constant(0.5f), in_albedo ? constant(0) : image(step));
    EXPECT_LT(result.pixel(kSide / 2 - 1, 5)[0], 0.02f);
    EXPECT_GT(result.pixel(kSide / 2, 5)[0], 0.98f);
  }
  // Without a guide, the edge is lost.
  EXPECT_GT(joint_bilateral(image(step), constant(0.5f), constant(0)).pixel(kSide / 2 - 1, 5)[0], 0.3f);
}

TEST(JointBilateral, LeavesOutWhatIsNotFinite) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const Image result =
      joint_bilateral(image([nan](int x, int) { return x == 3 ? nan : 2.0f; }), constant(0), constant(0));
  EXPECT_FLOAT_EQ(result.pixel(3, 3)[0], 2);
  EXPECT_EQ(joint_bilateral(constant(nan), constant(0), constant(0)).pixel(0, 0)[0], 0);
}

TEST(JointBilateral, RefusesOtherSizes) {
  EXPECT_THROW(joint_bilateral(constant(0), Image(3, 3, 3), constant(0)), Error);
}

}  // namespace
}  // namespace covary
