// SPDX-License-Identifier: Apache-2.0
#include "core/number_text.h"

#include <gtest/gtest.h>

namespace covary {
namespace {

TEST(NumberText, CountsInWords) {
  EXPECT_EQ(counted(1, "frame"), "1 frame");
  EXPECT_EQ(counted(0, "frame") + ", " + counted(7, "frame"), "0 frames, 7 frames");
  EXPECT_EQ(counted(1, "mesh", "meshes") + ", " + counted(2, "mesh", "meshes"), "1 mesh, 2 meshes");
}

}  // namespace
}  // namespace covary
