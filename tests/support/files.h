// SPDX-License-Identifier: Apache-2.0
// Temporary files of a test, and checks of error messages.
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "core/error.h"

namespace covary::test_support {

/// A new folder, removed with everything in it.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string pattern = (std::filesystem::temp_directory_path() / "covary_test_XXXXXX").string();
    COVARY_CHECK(mkdtemp(pattern.data()) != nullptr, "no temporary folder");
    path_ = pattern;
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }
  /// Path of a file in the folder.
  std::string file(const std::string& name) const { return (path_ / name).string(); }

 private:
  std::filesystem::path path_;
};

/// The folder of the running test in this process; empty at first use, removed when the process ends.
inline const std::filesystem::path& test_folder() {
  static std::map<const ::testing::TestInfo*, TemporaryFolder> folders;
  return folders[::testing::UnitTest::GetInstance()->current_test_info()].path();
}
inline std::string test_file(const std::string& name) { return (test_folder() / name).string(); }

/// The message of the Error that `call` throws, which must have `code` if given; "no error" if none is thrown.
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

/// Whether `text` contains `part`; prints both if not.
inline ::testing::AssertionResult contains(const std::string& text, const std::string& part) {
  if (text.find(part) != std::string::npos) return ::testing::AssertionSuccess();
  return ::testing::AssertionFailure() << "'" << part << "' is not in '" << text << "'";
}

}  // namespace covary::test_support
