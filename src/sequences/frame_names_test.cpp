// SPDX-License-Identifier: Apache-2.0
#include "sequences/frame_names.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "core/error.h"
#include "support/files.h"

namespace covary {
namespace {

TEST(FrameNames, HaveAtLeastAsManyDigitsAsThePattern) {
  EXPECT_EQ(frame_name("a/out_####.exr", 7), "a/out_0007.exr");
  EXPECT_EQ(frame_name("out_#.exr", 123), "out_123.exr");
  EXPECT_EQ(frame_name("take##_###.exr", 5), "take##_005.exr") << "the last run";
  EXPECT_EQ(frame_name("####", 0), "0000");
  EXPECT_TRUE(is_frame_pattern("a/out_#.exr"));
  EXPECT_FALSE(is_frame_pattern("a#/out.exr"));
  EXPECT_THROW(frame_name("out.exr", 1), Error);
}

TEST(FrameNames, MayBeWrittenAsOtherProgramsDo) {
  EXPECT_EQ(frame_name("a/out_%04d.exr", 7), "a/out_0007.exr");
  EXPECT_EQ(frame_name("out.%d.exr", 12), "out.12.exr");
  EXPECT_EQ(frame_name("out.<frame>.exr", 7), "out.0007.exr") << "four digits, as Maya pads";
  EXPECT_EQ(frame_name("100%d_##.exr", 7), "100%d_07.exr") << "'#' comes first";
  EXPECT_TRUE(is_frame_pattern("a/out.%06d.exr"));
  EXPECT_FALSE(is_frame_pattern("50%_done.exr"));
}

TEST(FrameRanges, AreOneFrameOrFirstToLastByStep) {
  FrameRange range;
  ASSERT_TRUE(read_frame_range("7", range));
  EXPECT_EQ(range.numbers(), std::vector<int>{7});
  ASSERT_TRUE(read_frame_range("1-3", range));
  EXPECT_EQ(range.numbers(), (std::vector<int>{1, 2, 3}));
  ASSERT_TRUE(read_frame_range("0-10:4", range));
  EXPECT_EQ(range.numbers(), (std::vector<int>{0, 4, 8}));
  for (const char* wrong : {"", "a", "1-", "-3", "3-1", "1-3:0", "1-3:", "1-2-3", "1.5", "9999999", " 1"})
    EXPECT_FALSE(read_frame_range(wrong, range)) << wrong;
}

TEST(FramesOnDisk, AreThoseOfThePatternInTheirOrder) {
  const test_support::TemporaryFolder folder;
  for (const char* name :
       {"f_0010.exr", "f_0002.exr", "f_3.exr", "f_0004.png", "f_00a4.exr", "g_0005.exr", "f_10000.exr"})
    std::ofstream(folder.file(name)) << 'x';
  EXPECT_EQ(frames_on_disk(folder.file("f_####.exr")), (std::vector<int>{2, 10, 10000}));
  EXPECT_THROW(frames_on_disk(folder.file("f.exr")), Error);
  for (const char* name : {"p_1", "p_2", "p_3"}) std::filesystem::create_directory(folder.file(name));
  for (const char* name : {"p_1/crn.exr", "p_3/crn.exr", "p_2/other.exr"}) std::ofstream(folder.file(name)) << 'x';
  EXPECT_EQ(frames_on_disk(folder.file("p_#/crn.exr")), (std::vector<int>{1, 3}));
  EXPECT_TRUE(is_frame_pattern_of_input(folder.file("p_#/crn.exr")));
  EXPECT_FALSE(is_frame_pattern_of_input(folder.file("p_1/crn.exr")));
  std::filesystem::create_directory(folder.file("p_#"));
  std::ofstream(folder.file("p_#/crn.exr")) << 'x';
  EXPECT_FALSE(is_frame_pattern_of_input(folder.file("p_#/crn.exr"))) << "a file of that name";
  EXPECT_THROW(frames_on_disk(folder.file("none/f_#.exr")), Error);
}

}  // namespace
}  // namespace covary
