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

}  // namespace
}  // namespace covary
