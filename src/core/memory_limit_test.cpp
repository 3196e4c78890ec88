// SPDX-License-Identifier: Apache-2.0
#include "core/memory_limit.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <optional>
#include <string>

#include "core/error.h"

namespace covary {
namespace {

class MemoryLimit : public testing::Test {
 protected:
  ~MemoryLimit() override { unsetenv("COVARY_MEMORY"); }
  static void set(const char* value) { setenv("COVARY_MEMORY", value, 1); }
  static std::string message(double bytes, ErrorCode code) {
    try {
      require_memory("a.png", "a texture of 30000 x 30000 pixels", bytes);
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), code);
      return error.what();
    }
    return "";
  }
};

TEST_F(MemoryLimit, IsAShareOfTheMachine) {
  unsetenv("COVARY_MEMORY");
  EXPECT_GT(machine_memory(), 1e8);
  EXPECT_EQ(memory_limit(), 0.75 * machine_memory());
  EXPECT_EQ(message(1e6, ErrorCode::kInput), "");
  EXPECT_NE(message(2 * machine_memory(), ErrorCode::kInput), "");
}

TEST_F(MemoryLimit, IsThatOfTheEnvironment) {
  set("4.5");
  EXPECT_EQ(memory_limit(), 4.5e9);
  EXPECT_EQ(message(4e9, ErrorCode::kInput), "");
  const std::string text = message(4.6e9, ErrorCode::kInput);
  EXPECT_NE(text.find("a.png: a texture of 30000 x 30000 pixels needs 4.6 GB of memory in addition to the "),
            std::string::npos);
  EXPECT_NE(text.find(" in use; the limit is 4.5 GB: use less, or raise it by the environment variable COVARY_MEMORY "),
            std::string::npos)
      << text;
  for (const char* wrong : {"much", "4 GB", "-1", "0", "0.1", "nan"}) {
    set(wrong);
    EXPECT_NE(message(4e9, ErrorCode::kUsage).find("expected a number of GB, at least 0.2"), std::string::npos)
        << wrong;
  }
}

}  // namespace
}  // namespace covary
