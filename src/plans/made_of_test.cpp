// SPDX-License-Identifier: Apache-2.0
#include "plans/made_of.h"

#include <gtest/gtest.h>

namespace covary {
namespace {

TEST(MadeOf, LeavesOutWhereTheImageGoes) {
  EXPECT_EQ(made_of("h", {{{"spp", "16"}, {"output", "a.exr"}, {"resume", ""}}, {{"max-depth", "4"}}}),
            "scene=h\nmax-depth=4\nspp=16");
}

TEST(MadeOf, NamesWhatDiffers) {
  const std::string first = made_of("h", {{{"spp", "16"}, {"aovs", ""}}});
  EXPECT_EQ(differences(first, first), "");
  EXPECT_EQ(differences(first, made_of("h", {{{"spp", "64"}, {"aovs", ""}}})), "spp 16, now 64");
  EXPECT_EQ(differences(first, made_of("h", {{{"spp", "64"}, {"aovs", ""}}}), true), "");
  EXPECT_EQ(differences(first, made_of("g", {{{"spp", "16"}, {"seed", "2"}}})),
            "aovs on, now default; another scene, or a changed one; seed default, now 2");
}

}  // namespace
}  // namespace covary
