// SPDX-License-Identifier: Apache-2.0
#include "device/binary_cache.h"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>

#include "support/files.h"

namespace covary::device {
namespace {

namespace fs = std::filesystem;

TEST(BinaryCache, ReturnsWhatWasStoredAndLeavesNothingElse) {
  const fs::path folder = fs::path(testing::TempDir()) / "binary_cache_test/a/b";
  fs::remove_all(folder);
  EXPECT_FALSE(cached_binary(folder, "key"));
  const std::string binary("bytes\0with zeros", 16);
  store_binary(folder, "key", binary);
  store_binary(folder, "key", binary);
  EXPECT_EQ(cached_binary(folder, "key"), binary);
  EXPECT_FALSE(cached_binary(folder, "other"));
  EXPECT_EQ(std::distance(fs::directory_iterator(folder), fs::directory_iterator()), 1);
}

TEST(BinaryCache, IgnoresADamagedFile) {
  const fs::path folder = fs::path(testing::TempDir()) / "binary_cache_test/damaged";
  fs::remove_all(folder);
  store_binary(folder, "key", "a binary of some length");
  fs::resize_file(folder / "key", fs::file_size(folder / "key") - 1);
  EXPECT_FALSE(cached_binary(folder, "key"));
  std::ofstream(folder / "empty").close();
  EXPECT_FALSE(cached_binary(folder, "empty"));
}

TEST(BinaryCache, DoesWithoutAFolder) {
  const fs::path file = fs::path(testing::TempDir()) / "binary_cache_file";
  std::ofstream(file) << "no folder";
  store_binary(file / "below", "key", "binary");
  EXPECT_FALSE(cached_binary(file / "below", "key"));
  store_binary({}, "key", "binary");
  EXPECT_FALSE(cached_binary({}, "key"));
}

}  // namespace
}  // namespace covary::device
