// SPDX-License-Identifier: Apache-2.0
#include "device/library.h"

#include <gtest/gtest.h>

namespace covary::device {
namespace {

TEST(Library, IsTheFirstFileThatCanBeLoaded) {
  std::string why;
  const Library library({"libno-such-library.so", "libm.so.6"}, why);
  ASSERT_TRUE(library);
  EXPECT_EQ(why, "");  // otherwise its functions would be taken for missing
  double (*cosine)(double) = nullptr;
  EXPECT_TRUE(library.bind("cos", cosine, why));
  EXPECT_EQ(cosine(0), 1);
}

TEST(Library, SaysWhatIsMissing) {
  std::string why;
  EXPECT_FALSE(Library({"libno-such-library.so", "libnor-this.so"}, why));
  EXPECT_NE(why.find("libno-such-library.so"), std::string::npos) << why;
  Loaded<int> loaded;
  const Library library({"libm.so.6"}, loaded.why);
  void (*function)() = nullptr;
  EXPECT_FALSE(library.bind("no_such_function", function, loaded.why));
  std::string reason;
  EXPECT_EQ(loaded.get(&reason), nullptr);
  EXPECT_EQ(reason, "no function no_such_function");
}

}  // namespace
}  // namespace covary::device
