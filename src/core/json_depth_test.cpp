// SPDX-License-Identifier: Apache-2.0
#include "core/json_depth.h"

#include <gtest/gtest.h>

#include <string>

namespace covary {
namespace {

TEST(JsonDepth, FindsTheLineWhereNestingPassesTheLimit) {
  const std::string most(kMaxJsonDepth, '['), closed(kMaxJsonDepth, ']');
  EXPECT_EQ(line_nested_too_deep(most + closed), 0);
  EXPECT_EQ(line_nested_too_deep(most + closed + "\n" + most + closed), 0);
  EXPECT_EQ(line_nested_too_deep(most + "\n\n{"), 3);
  EXPECT_EQ(line_nested_too_deep(std::string(200000, '[')), 1);
  EXPECT_EQ(line_nested_too_deep(""), 0);
}

TEST(JsonDepth, DoesNotCountBracketsInTexts) {
  const std::string many(1000, '[');
  EXPECT_EQ(line_nested_too_deep("\"" + many + "\""), 0);
  EXPECT_EQ(line_nested_too_deep("\"\\\"" + many + "\""), 0);
  EXPECT_EQ(line_nested_too_deep("\"\\\\\"\n" + many), 2);
  EXPECT_EQ(line_nested_too_deep("\"" + many), 0);
}

}  // namespace
}  // namespace covary
