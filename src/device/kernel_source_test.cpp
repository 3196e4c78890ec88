// SPDX-License-Identifier: Apache-2.0
#include "device/kernel_source.h"

#include <gtest/gtest.h>

#include "core/error.h"

namespace covary::device {
namespace {

TEST(KernelSource, IncludesTheHeaderOnce) {
  const std::string text = kernel_source("sum.cl");
  EXPECT_EQ(text.find("#include"), std::string::npos);
  const size_t first = text.find("#define KERNEL __kernel void");
  ASSERT_NE(first, std::string::npos);
  EXPECT_EQ(text.find("#define KERNEL __kernel void", first + 1), std::string::npos);
  EXPECT_NE(text.find("KERNEL sum("), std::string::npos);
}

TEST(KernelSource, KnowsItsFiles) {
  const std::vector<std::string> names = kernel_names();
  EXPECT_NE(std::find(names.begin(), names.end(), "sum.cl"), names.end());
  EXPECT_EQ(std::find(names.begin(), names.end(), "portable.h"), names.end());
  EXPECT_THROW(kernel_source("none.cl"), Error);
}

}  // namespace
}  // namespace covary::device
