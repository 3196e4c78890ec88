// SPDX-License-Identifier: Apache-2.0
#include "core/shell_text.h"

#include <gtest/gtest.h>

namespace covary {
namespace {

TEST(ShellText, ReadsTheWordsThatItWrote) {
  const std::vector<std::string> words = {"covary", "a b", "", "it's", "'", "\\", "--x=1", "$HOME"};
  EXPECT_EQ(shell_text({"a b", "c", ""}), "'a b' c ''");
  EXPECT_EQ(words_of_shell_text(shell_text(words)), words);
  EXPECT_EQ(words_of_shell_text("  a   b "), (std::vector<std::string>{"a", "b"}));
  EXPECT_TRUE(words_of_shell_text("").empty());
}

}  // namespace
}  // namespace covary
