// SPDX-License-Identifier: Apache-2.0
// Files of one test alone, and the messages of errors.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <optional>
#include <string>

#include "core/error.h"

namespace covary::test_support {

/// A folder that only the running test of this process uses; empty at first use.
inline std::filesystem::path test_folder() {
  const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
  std::string name =
      std::string("covary_") + info->test_suite_name() + "_" + info->name() + "_" + std::to_string(getpid());
  std::replace(name.begin(), name.end(), '/', '_');
  const std::filesystem::path folder = std::filesystem::path(::testing::TempDir()) / name;
  std::filesystem::create_directories(folder);
  return folder;
}
inline std::string test_file(const std::string& name) { return (test_folder() / name).string(); }

/// The message of the Error that `call` throws, which must have the code where one is given; "no error" when it throws none.
template <typename Call>
std::string message_of(Call&& call, std::optional<ErrorCode> code = {}) {
  try {
    call();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), code.value_or(error.code()));
    return error.what();
  }
  return "no error";
}

/// Whether `text` contains `part`; says both when not.
inline ::testing::AssertionResult contains(const std::string& text, const std::string& part) {
  if (text.find(part) != std::string::npos) return ::testing::AssertionSuccess();
  return ::testing::AssertionFailure() << "'" << part << "' is not in '" << text << "'";
}

}  // namespace covary::test_support
