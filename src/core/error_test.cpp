// SPDX-License-Identifier: Apache-2.0
#include "core/error.h"

#include <gtest/gtest.h>

namespace covary {
namespace {

using Names = std::vector<std::string>;
const Names kModels{"diffuse",   "dielectric",     "roughdielectric", "thindielectric",
                    "conductor", "roughconductor", "plastic"};

TEST(NearestNames, PutsTheBestFirst) {
  EXPECT_EQ(nearest_names("difuse", kModels), Names{"diffuse"});
  EXPECT_EQ(nearest_names("plastik", kModels), Names{"plastic"});
  EXPECT_EQ(nearest_names("roughdielectrics", kModels).front(), "roughdielectric");
  EXPECT_EQ(nearest_names("dielectric", kModels).front(), "dielectric");  // itself, at distance 0
}

TEST(NearestNames, LeavesOutWhatIsFar) {
  EXPECT_EQ(nearest_names("xyz", kModels), Names{});
  EXPECT_EQ(nearest_names("hair", kModels), Names{});
  EXPECT_EQ(nearest_names("", {"a", "bc"}), Names{"a"});  // a distance of 1 is always near
  EXPECT_EQ(nearest_names("name", {}), Names{});
}

TEST(NearestNames, GivesAtMostTheCountAndNoneTwice) {
  const Names candidates{"abcd", "abce", "abcf", "abcg", "abcd"};
  EXPECT_EQ(nearest_names("abcx", candidates), (Names{"abcd", "abce", "abcf"}));
  EXPECT_EQ(nearest_names("abcx", candidates, 1), Names{"abcd"});
  EXPECT_EQ(nearest_names("abcx", candidates, 10), (Names{"abcd", "abce", "abcf", "abcg"}));
}

TEST(DidYouMean, IsASentenceOrNothing) {
  EXPECT_EQ(did_you_mean("difuse", kModels), "; did you mean 'diffuse'?");
  EXPECT_EQ(did_you_mean("abcx", {"abcd", "abce"}), "; did you mean 'abcd' or 'abce'?");
  EXPECT_EQ(did_you_mean("xyz", kModels), "");
}

TEST(Check, ThrowsAnInternalErrorWithTheCondition) {
  COVARY_CHECK(1 + 1 == 2, "arithmetic");
  try {
    COVARY_CHECK(1 + 1 == 3, "arithmetic");
    FAIL() << "a false condition was accepted";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kInternal);
    EXPECT_STREQ(error.what(), "arithmetic (1 + 1 == 3)");
  }
}

}  // namespace
}  // namespace covary
