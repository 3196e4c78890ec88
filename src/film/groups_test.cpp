// SPDX-License-Identifier: Apache-2.0
#include "film/groups.h"

#include <gtest/gtest.h>

namespace covary {
namespace {

using Counts = std::vector<uint32_t>;

TEST(Groups, SizesCountTheSamplesOfEachGroup) {
  for (const int groups : {1, 2, 3, 5, 12})
    for (const uint32_t count : {0u, 1u, 2u, 7u, 12u, 13u, 100u}) {
      Counts counted(groups);
      for (uint32_t s = 0; s < count; ++s) ++counted[s % groups];
      for (int g = 0; g < groups; ++g) EXPECT_EQ(group_size(count, groups, g), counted[g]) << count << ", " << groups;
    }
  static_assert(group_size(0xffffffff, 2, 0) == 0x80000000);
}

TEST(Groups, AreEqualWhereTheyCanBe) {
  EXPECT_EQ(choose_groups(Counts{96, 96}), 12);
  EXPECT_EQ(choose_groups(Counts{24, 24}), 12);
  EXPECT_EQ(choose_groups(Counts{32}), 8);
  EXPECT_EQ(choose_groups(Counts{50, 50}), 10);
  EXPECT_EQ(choose_groups(Counts{22, 33}), 11);
  EXPECT_EQ(choose_groups(Counts{16, 16}), 8);
  EXPECT_EQ(choose_groups(Counts{13, 12}), 12) << "of sizes 2 and 1";
  EXPECT_EQ(choose_groups(Counts{34}), 12);
  EXPECT_EQ(choose_groups(Counts{7, 6}), 6);
  EXPECT_EQ(choose_groups(Counts{4}), 4);
  EXPECT_EQ(choose_groups(Counts{0}), 1);
}

TEST(Groups, SamplesAreDividedWithoutARest) {
  using Parts = std::vector<double>;
  const Parts halves{0.5, 0.5};
  EXPECT_EQ(split_samples(192, halves, 4), (Counts{96, 96}));
  EXPECT_EQ(split_samples(25, halves, 4), (Counts{13, 12}));
  EXPECT_EQ(split_samples(8, halves, 4), (Counts{4, 4}));
  EXPECT_EQ(split_samples(7, halves, 3), (Counts{4, 3}));
  EXPECT_EQ(split_samples(7, halves, 4), (Counts{4, 4})) << "as few as there must be";
  EXPECT_EQ(split_samples(1u << 30, halves, 4), (Counts{1u << 29, 1u << 29}));
  EXPECT_EQ(split_samples(0xffffffff, halves, 1), (Counts{0x80000000, 0x7fffffff}));
  EXPECT_EQ(split_samples(192, Parts{0.25, 0.75}, 4), (Counts{48, 144}));
  EXPECT_EQ(split_samples(96, Parts{1 / 3.0, 2 / 3.0}, 4), (Counts{32, 64}));
  EXPECT_EQ(split_samples(10, Parts{1 / 1001.0, 1000 / 1001.0}, 4), (Counts{4, 6}));
  EXPECT_EQ(split_samples(10, Parts{1000 / 1001.0, 1 / 1001.0}, 4), (Counts{6, 4}));
  EXPECT_EQ(split_samples(5, Parts{1}, 1), (Counts{5}));
  EXPECT_EQ(split_into_whole_groups(145, halves, 12), (Counts{84, 84}));
  EXPECT_EQ(split_into_whole_groups(144, Parts{0.25, 0.75}, 12), (Counts{36, 108}));
  EXPECT_EQ(split_into_whole_groups(0, halves, 5), (Counts{5, 5}));
}

}  // namespace
}  // namespace covary
