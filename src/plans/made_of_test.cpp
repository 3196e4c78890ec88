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
            "aovs on, now default; seed default, now 2; another scene, or a changed one");
}

TEST(MadeOf, NamesWhatChangedTheScene) {
  const std::string first = made_of("h", {{{"spp", "16"}, {"camera", "2"}}});
  EXPECT_EQ(differences(first, made_of("g", {{{"spp", "16"}, {"environment", "sky"}}})),
            "camera 2, now default; environment default, now sky");
  EXPECT_EQ(differences(first, made_of("g", {{{"spp", "16"}, {"camera", "2"}, {"define", "depth=3"}}})),
            "define default, now depth=3");
  EXPECT_EQ(differences(first, made_of("g", {{{"spp", "16"}, {"camera", "2"}}})), "another scene, or a changed one");
}

TEST(MadeOf, NamesPlacesWithoutTheirHashes) {
  const auto at = [](const char* place, const char* after) {
    return made_of("h", {{{kMadeAtPlace, place}, {kMadeAfter, after}, {kMadeAtTime, "1"}}});
  };
  EXPECT_EQ(differences(at("12ab", "34"), at("56cd", "34")), "another place of the camera");
  EXPECT_EQ(differences(at("12ab", "34"), at("12ab", "56")), "another previous frame");
}

}  // namespace
}  // namespace covary
