// SPDX-License-Identifier: Apache-2.0
#include "plans/made_of.h"

#include <gtest/gtest.h>

#include <optional>

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

TEST(MadeOf, TheSameSceneInOtherWordsIsTheSame) {
  const std::string usual = made_of("h", {{{"spp", "16"}}});
  const OptionValues named = {{"spp", "16"}, {"camera", "auto"}, {"environment", "studio"}};
  EXPECT_EQ(differences(usual, made_of("h", {named})), "");
  EXPECT_EQ(differences(usual, made_of("g", {named})), "camera default, now auto; environment default, now studio");
}

TEST(MadeOf, NamesPlacesWithoutTheirHashes) {
  const auto at = [](const char* place, const char* after) {
    return made_of("h", {{{kMadeAtPlace, place}, {kMadeAfter, after}, {kMadeAtTime, "1"}}});
  };
  EXPECT_EQ(differences(at("12ab", "34"), at("56cd", "34")), "another place of the camera");
  EXPECT_EQ(differences(at("12ab", "34"), at("12ab", "56")), "another previous frame");
}

TEST(MadeOf, AnotherGoalMayBeReachedAlready) {
  const std::string made = made_of("h", {{{"until", "relmse=0.01"}, {"seed", "2"}}});
  const std::string now = made_of("h", {{{"until", "relmse=0.008"}, {"seed", "2"}}});
  EXPECT_TRUE(reaches({made, true, 0.003}, now, 0.008));
  EXPECT_FALSE(reaches({made, true, 0.009}, now, 0.008));
  EXPECT_FALSE(reaches({made, false, 0.003}, now, 0.008)) << "interrupted";
  EXPECT_FALSE(reaches({made, true, std::nullopt}, now, 0.008));
  EXPECT_FALSE(reaches({made, true, 0.003}, made_of("h", {{{"until", "relmse=0.008"}}}), 0.008)) << "another seed";
  EXPECT_FALSE(reaches(made_file("/no/such.exr"), now, 0.008));
}

}  // namespace
}  // namespace covary
