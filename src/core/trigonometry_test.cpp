// SPDX-License-Identifier: Apache-2.0
#include "core/trigonometry.h"

#include <gtest/gtest.h>

namespace covary {
namespace {

TEST(Trigonometry, AgreesWithTheLibrary) {
  for (int i = -4000; i <= 4000; ++i) {
    const double turns = i / 2000.0;
    const SinCos found = sincos_turns(static_cast<float>(turns));
    EXPECT_NEAR(found.sin, std::sin(2 * M_PI * static_cast<float>(turns)), 1.5e-7) << turns;
    EXPECT_NEAR(found.cos, std::cos(2 * M_PI * static_cast<float>(turns)), 1.5e-7) << turns;
    const double angle = M_PI / 4 * i / 4000;
    EXPECT_NEAR(sincos_octant(static_cast<float>(angle)).sin, std::sin(angle), 1e-7);
    EXPECT_NEAR(sincos_octant(static_cast<float>(angle)).cos, std::cos(angle), 1e-7);
  }
}

TEST(Trigonometry, AngleAgreesWithTheLibrary) {
  for (int i = 0; i < 8000; ++i) {
    const double angle = 2 * M_PI * (i + 0.25) / 8000, radius = std::exp2(i % 40 - 20);
    const auto x = static_cast<float>(radius * std::cos(angle)), y = static_cast<float>(radius * std::sin(angle));
    double expected = std::atan2(double{y}, double{x}) / (2 * M_PI);
    if (expected < 0) expected += 1;
    EXPECT_NEAR(angle_turns(y, x), expected, 1e-7) << angle;
  }
  EXPECT_EQ(angle_turns(0, 1), 0);
  EXPECT_EQ(angle_turns(1, 0), 0.25f);
  EXPECT_EQ(angle_turns(0, -1), 0.5f);
  EXPECT_EQ(angle_turns(-1, 0), 0.75f);
  EXPECT_EQ(angle_turns(0, 0), 0);
}

}  // namespace
}  // namespace covary
